"""Where reaches begin and end according to who recorded them.

Two files bring labels: the ADL Vicon reaches (``onset`` and ``offset`` of each trial, set by a rule:
5 % of the peak speed of the wrist) and the pick-and-place runs of Gutzeit et al. (``segment`` and
``segment_label``, set by hand, several a run). See :mod:`hri_prediction.tracks.adapters`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.files.arrays import parse_arrays
from hri_prediction.files.content import read_content
from hri_prediction.tracks.adapters import ADL_RATE_HZ, is_adl_arrays, is_run_arrays
from hri_prediction.tracks.segmentation import Reach
from hri_prediction.tracks.tables import one_number

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
    content = read_content(path)
    if content[:2] != b"PK":
        return {}
    try:
        return parse_arrays(content)
    except DataError as error:
        raise DataError(f"cannot read {path}: {error.problem}", expected=error.expected) from error


def onset_labels(path: str | Path) -> list[Reach] | None:
    """One reach a trial, in the order and on the clock of the file's tracks; none without labels.

    Raises:
        DataError: when the file is damaged, has other than one onset and one offset a trial, or a movement
            ends before it begins.
    """
    arrays = _arrays(path)
    if not is_adl_arrays(arrays) or "offset" not in arrays:
        return None
    onset, offset = arrays["onset"], arrays["offset"]
    for name, array in (("onset", onset), ("offset", offset)):
        _check(path, name, array, "iuf", (onset.size,))
    durations = (offset.astype(float) - onset.astype(float)) / ADL_RATE_HZ
    if not (durations > 0.0).all():
        trial = int(np.flatnonzero(~(durations > 0.0))[0])
        raise DataError(
            f"{path}: trial {trial} lasts {durations[trial]:g} s", expected="onset < offset"
        )
    return [Reach(0.0, float(duration)) for duration in durations]


def segment_labels(path: str | Path) -> list[list[tuple[str, Reach]]] | None:
    """The labelled segments of each run, on the clock of the file's tracks; none without labels.

    Raises:
        DataError: when the file is damaged, or its segments are not whole numbers, of runs that are there.
    """
    arrays = _arrays(path)
    if not is_run_arrays(arrays) or "segment" not in arrays or "segment_label" not in arrays:
        return None
    segments, names = arrays["segment"], arrays["segment_label"]
    _check(path, "segment_label", names, "U", (names.size,))
    _check(path, "segment", segments, "iu", (names.size, 3))
    rate = one_number(arrays, "rate_hz")
    runs: list[list[tuple[str, Reach]]] = [[] for _ in range(arrays["run"].size)]
    for (run, first, last), name in zip(segments.tolist(), names, strict=True):
        if not (0 <= run < len(runs) and rate > 0.0):
            raise DataError(
                f"{path}: a segment of run {run} at {rate:g} Hz",
                expected=f"runs 0 to {len(runs) - 1} at a positive rate",
            )
        runs[run].append((str(name), Reach(first / rate, last / rate)))
    return runs


def _check(
    path: str | Path, name: str, array: np.ndarray, kinds: str, shape: tuple[int, ...]
) -> None:
    if array.shape != shape or array.dtype.kind not in kinds:
        what = "texts" if kinds == "U" else "numbers"
        raise DataError(
            f"{path}: {name} is {array.dtype} {array.shape}", expected=f"{what} {shape}"
        )


def whole_movements(segments: list[tuple[str, Reach]]) -> list[Reach]:
    """The labelled movements of a run, without their parts and without rest, in the order of time."""
    chosen = [reach for name, reach in segments if name != IDLE and not name.endswith(PART)]
    return sorted(chosen, key=lambda reach: reach.onset_s)
