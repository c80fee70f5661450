"""Whether the counts in a C3D file can be true, before anything is allocated or looked up by them.

ezc3d believes every count. One altered byte in the header or in the parameter section makes it ask for
gigabytes, read text as numbers, or look up what is not there, which ends the process; the length of the
file tells better.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

from hri_prediction.errors import DataError
from hri_prediction.tracks.importers.c3d_order import BLOCK
from hri_prediction.tracks.importers.c3d_parameters import TEXT, Parameter, parameters_of

MOST_FRAMES = 65535
"""Recordings with more frames than 16 bits can count have this as the number of their last one."""
_LARGEST = 1 << 30
"""Such a file may be shorter than its header says, as long as it asks for no more than this [bytes]."""
_ANALOG = ("ANALOG:USED", "ANALOG:SCALE", "ANALOG:OFFSET")
"""What ezc3d looks up for each analogue value without asking whether it is there."""
_NUMBERS = (
    *("POINT:USED", "POINT:FRAMES", "POINT:SCALE", "POINT:RATE"),
    *("ANALOG:USED", "ANALOG:RATE", "ANALOG:GEN_SCALE"),
    *("ROTATION:USED", "ROTATION:DATA_START", "ROTATION:RATIO", "ROTATION:RATE"),
)
"""Where a parameter is there, ezc3d takes its first value without asking whether there is one."""
_ROTATION_VALUES = 17
_MOST_RATIO = 65535
"""Analogue values, or rotations, of a channel in a frame of points."""


def check_counts(content: bytes, order: str) -> None:
    """Compare header and parameter section with each other and with the length of the file.

    Args:
        content: The file.
        order: Byte order: ``Intel``, ``DEC`` or ``MIPS``.

    Raises:
        DataError: when data or a parameter would reach beyond their place, or a parameter that is needed
            has no value.
    """
    end = ">" if order == "MIPS" else "<"
    points, values, first, last = struct.unpack_from(f"{end}4H", content, 2)
    (data,) = struct.unpack_from(f"{end}H", content, 16)
    # The scale is negative where numbers are floating point; a VAX keeps the sign in its second byte.
    real = content[12 if order == "MIPS" else 15 if order == "Intel" else 13] & 0x80
    frames = last - first + 1
    width = 4 if real else 2
    size = (4 * points + values) * width
    there = max(0, len(content) - (data - 1) * BLOCK)
    if frames * size > there and not (last == MOST_FRAMES and frames * size <= _LARGEST):
        raise DataError(
            f"the C3D file is cut off, or its header is wrong: {frames} frames of {points} points and "
            f"{values} analogue values need {frames * size} bytes, {there} are there",
            expected="a whole C3D file",
        )
    found = parameters_of(content, order, (content[0] - 1) * BLOCK + 4)
    lacking = [name for name in _ANALOG if values and not (name in found and found[name].count)]
    if lacking:
        raise DataError(
            f"the C3D file has analogue values, but no parameter {lacking[0]}",
            expected="a whole C3D file",
        )
    numbers = {name: _number(found, name) for name in _NUMBERS}
    _check_frame(found, numbers, there // width)
    _check_rotations(numbers, frames, there // width)


def _number(found: Mapping[str, Parameter], name: str) -> float:
    """The first value of a parameter; 0 where there is no such parameter."""
    if name not in found:
        return 0.0
    numbers = found[name].numbers
    if not len(numbers) or not math.isfinite(numbers[0]):
        raise DataError(
            f"the C3D file has no value of {name} that can be used", expected="a finite number"
        )
    return float(numbers[0])


def _check_frame(found: Mapping[str, Parameter], numbers: Mapping[str, float], there: int) -> None:
    """One frame, as the parameters describe it, must not be longer than all data."""
    channels, rate = numbers["ANALOG:USED"], numbers["POINT:RATE"]
    ratio = numbers["ANALOG:RATE"] / rate if rate >= 1.0 else 1.0
    values = 4.0 * numbers["POINT:USED"] + channels * math.floor(max(ratio, 1.0))
    counts = (channels, numbers["POINT:USED"], rate, ratio)
    if min(counts) < 0.0 or ratio > _MOST_RATIO or values > there:
        raise DataError(
            f"the C3D file is cut off, or its parameters are wrong: {numbers['POINT:USED']:g} points and "
            f"{channels:g} analogue channels at {ratio:g} times the rate of points, and {there} values",
            expected="a whole C3D file",
        )
    for name in ("SCALE", "OFFSET"):
        parts = [found.get(f"ANALOG:{name}{number or ''}") for number in (0, *range(2, 200))]
        known = sum(part.count for part in parts if part is not None and part.kind != TEXT)
        # Files of Shadow say nothing of either.
        shadow = not known and any(key.startswith("SHADOW:") for key in found)
        if known < channels and not shadow:
            raise DataError(
                f"the C3D file has {channels:g} analogue channels, but {known} values of ANALOG:{name}",
                expected="a whole C3D file",
            )


def _check_rotations(numbers: Mapping[str, float], frames: int, there: int) -> None:
    """All rotations must not be longer than all data."""
    rate = numbers["POINT:RATE"]
    ratio = max(numbers["ROTATION:RATIO"], numbers["ROTATION:RATE"] / rate if rate >= 1.0 else 0.0)
    counts = (numbers["ROTATION:USED"], numbers["ROTATION:DATA_START"], numbers["ROTATION:RATIO"])
    total = _ROTATION_VALUES * numbers["ROTATION:USED"] * max(ratio, 1.0) * frames
    if min(counts) < 0.0 or ratio > _MOST_RATIO or total > there:
        raise DataError(
            f"the C3D file is cut off, or its parameters are wrong: {counts[0]:g} rotations at {ratio:g} "
            f"times the rate of points in {frames} frames, and {there} values",
            expected="a whole C3D file",
        )
