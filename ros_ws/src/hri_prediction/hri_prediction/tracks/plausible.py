"""Whether a track can be a person's arm: the segments of anything else have other lengths."""

from __future__ import annotations

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.tracks.importers.units import UNITS
from hri_prediction.tracks.track import ArmSample, ArmTrack

SEGMENT_M = (0.15, 0.6)
"""Shortest and longest upper arm or forearm that is believed [m]: from children to what markers on the
skin add."""
_SEGMENTS = ("upper arm", "forearm")
_HAND_M = 0.3
"""Longest hand, from the wrist to the tip [m]."""
_SINGLE = 0.5, 1.5
"""Markers move on the skin, and noise comes on top: a single sample may be so far out of those limits."""


def check_arm(track: ArmTrack, where: str = "", hint: str = "") -> None:
    """Refuse a track whose upper arm or forearm is as long as none is: mostly a wrong unit.

    Medians are looked at, so that single outliers do not count; what is never seen is not judged.

    Args:
        track: The track, in metres as all tracks.
        where: What the error names it, such as its number in a file.
        hint: What to do about it; empty: found by the length.

    Raises:
        DataError: with the length, and the unit that would make it right if there is one.
    """
    points = track.keypoints
    spans = [np.linalg.norm(points[:, i + 1] - points[:, i], axis=1) for i in (0, 1)]
    lengths = {
        name: float(np.median(span[np.isfinite(span)]))
        for name, span in zip(_SEGMENTS, spans, strict=True)
        if np.isfinite(span).any()
    }
    low, high = SEGMENT_M
    wrong = [name for name, length in lengths.items() if not low <= length <= high]
    if not wrong:
        return
    name = wrong[0]
    raise DataError(
        f"{where + ': ' if where else ''}the {name} is {lengths[name]:.4g} m long (median)",
        expected=f"upper arm and forearm of {low:g} to {high:g} m",
        hint=hint or _hint(lengths),
    )


def check_sample(sample: ArmSample, whose: str) -> None:
    """Refuse a single sample of which a segment is far from any arm's: mostly a wrong unit.

    Args:
        sample: In metres; what is not seen is not judged.
        whose: What the error names it.

    Raises:
        DataError: with the length.
    """
    spans = np.linalg.norm(np.diff(sample.keypoints, axis=0), axis=1)
    low, high = SEGMENT_M
    limits = ((low, high), (low, high), (0.0, _HAND_M))
    for name, span, (least, most) in zip((*_SEGMENTS, "hand"), spans, limits, strict=True):
        if span < _SINGLE[0] * least or span > _SINGLE[1] * most:  # NaN is neither
            raise DataError(
                f"the {sample.side} {name} of {whose} is {span:.3g} m long",
                expected=f"{least:g} to {most:g} m",
                hint="check the unit: positions are in metres",
            )


def _hint(lengths: dict[str, float]) -> str:
    """The unit that makes all of them right, if there is one."""
    low, high = SEGMENT_M
    for unit, metres in UNITS.items():
        if all(low <= length * metres <= high for length in lengths.values()):
            return (
                f"tracks are in metres, these numbers look like {unit}: multiply them by "
                f"{metres:g}, or import the original with scripts/import_mocap.py --units {unit}"
            )
    return "check which points are shoulder, elbow and wrist, and their unit"
