"""Whether a process needs more and more time for the same work, as one that keeps all it has done."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

LEAST_S = 120.0
"""A life that is judged, after its beginning [s]: goals and faults make shares of a core uneven."""
MOST_SHARE, MOST_CORES = 0.2, 0.03
"""A process' load has grown when the median of its last third is more than this above that of its first:
as a share of it, and in cores."""
_BLOCK_S = 10.0


def load_growth(times_s: Sequence[float], processor_s: Sequence[float]) -> list[float] | None:
    """Cores that a process used in the first and in the last third of a time, or nothing of a short one.

    Args:
        times_s: Times (N,) [s], rising.
        processor_s: Processor time since the process began (N,) [s].
    """
    if len(times_s) < 2 or times_s[-1] - times_s[0] < LEAST_S:
        return None
    edges = np.arange(times_s[0], times_s[-1], _BLOCK_S)
    cores = np.diff(np.interp(edges, times_s, processor_s)) / _BLOCK_S
    third = len(cores) // 3
    return [float(np.median(cores[:third])), float(np.median(cores[-third:]))]


def grown(load: Sequence[float]) -> float:
    """By how much a load has grown as a share of what it was; 0 where it is too little to matter."""
    first, last = load
    return last / max(first, 1e-3) - 1.0 if last - first > MOST_CORES else 0.0


def load_of(points: Sequence[tuple[float, dict[str, Any]]]) -> list[float] | None:
    """The same of samples (time [s], figures) of a process."""
    return load_growth([s for s, _ in points], [f["cpu_s"] for _, f in points])
