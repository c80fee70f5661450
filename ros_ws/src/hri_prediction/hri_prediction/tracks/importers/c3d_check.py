"""Whether the counts in a C3D file can be true, before anything is allocated by them.

ezc3d believes every count. One altered byte in the header or in the parameter section makes it ask for
gigabytes, or read text as numbers; the length of the file tells better.
"""

from __future__ import annotations

import math
import struct

from hri_prediction.errors import DataError
from hri_prediction.tracks.importers.c3d_order import BLOCK

MOST_FRAMES = 65535
"""Recordings with more frames than 16 bits can count have this as the number of their last one."""
_LARGEST = 1 << 30
"""Such a file may be shorter than its header says, as long as it asks for no more than this [bytes]."""
_KINDS = (-1, 1, 2, 4)
_ANALOG = ("ANALOG:USED", "ANALOG:SCALE", "ANALOG:OFFSET")
"""What ezc3d looks up for each analogue value without asking whether it is there."""


def check_counts(content: bytes, order: str) -> None:
    """Compare header and parameter section with the length of the file.

    Args:
        content: The file.
        order: Byte order: ``Intel``, ``DEC`` or ``MIPS``.

    Raises:
        DataError: when data or a parameter would reach beyond their place.
    """
    end = ">" if order == "MIPS" else "<"
    points, values, first, last = struct.unpack_from(f"{end}4H", content, 2)
    (data,) = struct.unpack_from(f"{end}H", content, 16)
    # The scale is negative where numbers are floating point; a VAX keeps the sign in its second byte.
    real = content[12 if order == "MIPS" else 15 if order == "Intel" else 13] & 0x80
    frames = last - first + 1
    size = (4 * points + values) * (4 if real else 2)
    there = max(0, len(content) - (data - 1) * BLOCK)
    if frames * size > there and not (last == MOST_FRAMES and frames * size <= _LARGEST):
        raise DataError(
            f"the C3D file is cut off, or its header is wrong: {frames} frames of {points} points and "
            f"{values} analogue values need {frames * size} bytes, {there} are there",
            expected="a whole C3D file",
        )
    found = _parameters(content, end, (content[0] - 1) * BLOCK + 4)
    lacking = [name for name in _ANALOG if values and not found.get(name)]
    if lacking:
        raise DataError(
            f"the C3D file has analogue values, but no parameter {lacking[0]}",
            expected="a whole C3D file",
        )


def _parameters(content: bytes, end: str, at: int) -> dict[str, int]:
    """How many values each parameter has, ``GROUP:NAME``; entries begin at ``at``.

    Raises:
        DataError: when one does not end where the next begins.
    """
    groups: dict[int, str] = {}
    found: list[tuple[int, str, int]] = []
    try:
        while content[at] and content[at + 1]:
            length, group = struct.unpack_from("bb", content, at)
            link = at + 2 + abs(length)
            (step,) = struct.unpack_from(f"{end}H", content, link)
            text = link + 2
            name = content[at + 2 : link].decode("latin-1").upper()
            if group < 0:
                groups[-group] = name
            else:
                kind, count = struct.unpack_from("bB", content, text)
                sizes = content[text + 2 : text + 2 + count]
                found.append((group, name, math.prod(sizes)))
                text += 2 + count + abs(kind) * math.prod(sizes)
                if kind not in _KINDS:
                    raise IndexError(kind)
            beyond = text + 1 + content[text]
            # ezc3d reads on from there, wherever the file says that the next one is.
            if beyond > len(content) or (step and beyond != link + step):
                raise IndexError(beyond)
            if not step:
                break
            at = link + step
    except (struct.error, IndexError) as error:
        raise DataError(
            f"the C3D file is damaged: its parameter section does not hold together at byte {at}",
            expected="a whole C3D file",
        ) from error
    return {f"{groups.get(group, '')}:{name}": number for group, name, number in found}
