"""Where reaches begin and end according to who recorded them.

Two files bring labels: the ADL Vicon reaches (``onset`` and ``offset`` of each trial, set by a rule:
5 % of the peak speed of the wrist) and the pick-and-place runs of Gutzeit et al. (``segment`` and
``segment_label``, set by hand, several a run). See :mod:`hri_prediction.tracks.adapters`.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.tracks.adapters import ADL_RATE_HZ, is_adl_arrays, is_run_arrays
from hri_prediction.tracks.segmentation import Reach

ONSET_LABEL_SPEED = 0.05
"""Share of the peak speed at which the ADL Vicon reaches are labelled to begin and to end."""
PART = "_part"
"""Ending of labels for a piece of a movement that is labelled as a whole as well."""
IDLE = "idle"
"""Label of what is no movement."""


def _arrays(path: str | Path) -> Mapping[str, np.ndarray]:
    path = Path(path)
    if not path.is_file():
        return {}
    content = path.read_bytes()
    if content[:2] != b"PK":
        return {}
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}


def onset_labels(path: str | Path) -> list[Reach] | None:
    """One reach a trial, in the order and on the clock of the file's tracks; none without labels.

    Raises:
        DataError: when a movement ends before it begins.
    """
    arrays = _arrays(path)
    if not is_adl_arrays(arrays) or "offset" not in arrays:
        return None
    durations = (arrays["offset"] - arrays["onset"]) / ADL_RATE_HZ
    if (durations <= 0.0).any():
        trial = int(np.flatnonzero(durations <= 0.0)[0])
        raise DataError(
            f"{path}: trial {trial} lasts {durations[trial]:g} s", expected="onset < offset"
        )
    return [Reach(0.0, float(duration)) for duration in durations]


def segment_labels(path: str | Path) -> list[list[tuple[str, Reach]]] | None:
    """The labelled segments of each run, on the clock of the file's tracks; none without labels."""
    arrays = _arrays(path)
    if not is_run_arrays(arrays):
        return None
    rate = float(arrays["rate_hz"])
    runs: list[list[tuple[str, Reach]]] = [[] for _ in arrays["start"]]
    for (run, first, last), name in zip(arrays["segment"], arrays["segment_label"], strict=True):
        runs[int(run)].append((str(name), Reach(int(first) / rate, int(last) / rate)))
    return runs


def whole_movements(segments: list[tuple[str, Reach]]) -> list[Reach]:
    """The labelled movements of a run, without their parts and without rest, in the order of time."""
    chosen = [reach for name, reach in segments if name != IDLE and not name.endswith(PART)]
    return sorted(chosen, key=lambda reach: reach.onset_s)
