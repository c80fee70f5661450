"""Each process' memory over its life, and whether it grows."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_sim.soak.faults import PAUSE
from hri_sim.soak.growth import Growth, memory_growth
from hri_sim.soak.load import load_of

FloatArray = NDArray[np.float64]
Points = list[tuple[float, dict[str, Any]]]
"""Samples of one process: time [s], figures."""

WARM_UP_S = 30.0
"""A process that has just begun still loads; its memory counts from then on [s]."""
LEAST_S, LEAST_SHARE = 20.0, 0.2
"""Processes are judged that lived at least so long after that: seconds, and share of the run."""
LEAST_SAMPLES = 10
BESIDE_S = 5.0
"""What a process keeps of its first standstill: difference of medians over so long on both sides [s]."""
CAUGHT_UP_S = 2.0
"""After a standstill what has piled up is dealt with for at most so long [s]."""


def lives(samples: Sequence[dict[str, Any]]) -> dict[tuple[str, float], Points]:
    """Samples (time [s], figures) of each process, by its name and when it was born."""
    found: dict[tuple[str, float], Points] = defaultdict(list)
    for sample in samples:
        for label, figures in sample["processes"].items():
            found[label, figures["born"]].append((float(sample["s"]), figures))
    return dict(found)


def memory_rows(
    samples: Sequence[dict[str, Any]], faults: Sequence[dict[str, Any]] = ()
) -> list[dict[str, Any]]:
    """Each process' memory: a row a life, judged or not.

    Args:
        samples: Of the run, in order.
        faults: That came in it: of a process' first standstill it keeps memory, which is no growth.
    """
    length_s = float(samples[-1]["s"] - samples[0]["s"]) if samples else 0.0
    rows = []
    for (label, _), points in lives(samples).items():
        begin_s = points[0][0]
        old = [(s, f) for s, f in points if s - begin_s >= WARM_UP_S]
        warm = (old or points)[0][1]
        growth: Growth | None = None
        kept_mb = 0.0
        if len(old) >= LEAST_SAMPLES and old[-1][0] - old[0][0] >= max(
            LEAST_S, LEAST_SHARE * length_s
        ):
            times = np.array([s for s, _ in old])
            memory = np.array([f["memory_mb"] for _, f in old])
            stood = first_standstill(faults, label, begin_s, old[-1][0])
            if stood is not None:
                kept_mb = kept(times, memory, *stood)
                memory = np.where(times > stood[0], memory - kept_mb, memory)
            growth = memory_growth(times, memory)
        rows.append(
            {
                "node": label,
                "lived_s": round(points[-1][0] - begin_s, 1),
                "most_mb": max(f["memory_mb"] for _, f in points),
                "resident_mb": points[-1][1]["resident_mb"],
                "threads": [warm["threads"], points[-1][1]["threads"]],
                "files": [warm["files"], points[-1][1]["files"]],
                "cores": _cores(points),
                "load": load_of(old),
                "growth": None if growth is None else asdict(growth),
                "kept_mb": round(kept_mb, 3),
            }
        )
    return rows


def first_standstill(
    faults: Sequence[dict[str, Any]], label: str, begin_s: float, end_s: float
) -> tuple[float, float] | None:
    """From when to when a process was stopped by a signal for the first time [s]; none: it never was.

    Args:
        faults: Of the run.
        label: Name of the process.
        begin_s: When it was started.
        end_s: When it was seen last.
    """
    begins = [
        (float(f["s"]), float(f["s"] + f["seconds"]))
        for f in faults
        if f["fault"] == PAUSE and f["node"] == label and begin_s <= f["s"] <= end_s
    ]
    return min(begins, default=None)


def kept(times_s: FloatArray, memory: FloatArray, from_s: float, until_s: float) -> float:
    """What a process keeps, once and for all, of its first standstill; never less than 0.

    The middleware takes memory for all that piled up, and keeps it for the next time: a recorder that
    stood for 1.6 s had 69.7 MB before and 76.1 MB afterwards, and 76.3 MB after four more times. Only
    the first counts so: a process that takes more with each is one that grows.

    Args:
        times_s: Times (N,) [s], rising.
        memory: Memory (N,), in any unit.
        from_s: When it was stopped [s].
        until_s: When it went on [s].
    """
    after_s = until_s + CAUGHT_UP_S
    before = memory[(times_s <= from_s) & (times_s > from_s - BESIDE_S)]
    after = memory[(times_s >= after_s) & (times_s < after_s + BESIDE_S)]
    if not len(before) or not len(after):
        return 0.0
    return max(float(np.median(after) - np.median(before)), 0.0)


def _cores(points: Points) -> float | None:
    seconds = points[-1][0] - points[0][0]
    if seconds <= 0.0:
        return None
    return float((points[-1][1]["cpu_s"] - points[0][1]["cpu_s"]) / seconds)
