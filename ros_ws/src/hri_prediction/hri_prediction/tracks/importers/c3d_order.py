"""C3D files in MIPS byte order (big-endian) as the same file in Intel's, which ezc3d reads.

The header is made of 16-bit words and some floating point numbers, the parameter section of entries
of their own types, and the data of 16-bit words or 32-bit floating point numbers.
"""

from __future__ import annotations

import struct

from hri_prediction.errors import DataError

BLOCK = 512
INTEL = 84
_HEADER_FLOATS = (12, 20)
"""Bytes at which the scale and the frame rate stand."""
_EVENT_TIMES = slice(304, 376)


def intel_of_mips(content: bytes) -> bytes:
    """The file with every number turned round.

    Raises:
        DataError: when an entry of the parameter section reaches beyond its end.
    """
    start = (content[0] - 1) * BLOCK
    data = (struct.unpack_from(">H", content, 16)[0] - 1) * BLOCK
    real = bool(content[12] & 0x80)
    out = bytearray(content)
    _turn(out, 2, BLOCK, 2)
    for at in (*_HEADER_FLOATS, *range(_EVENT_TIMES.start, _EVENT_TIMES.stop, 4)):
        out[at : at + 4] = content[at : at + 4][::-1]
    out[376:396] = content[376:396]  # event flags and labels are bytes
    out[396:468] = content[396:468]
    out[start + 3] = INTEL
    _turn_parameters(out, content, start + 4, data)
    _turn(out, data, len(out), 4 if real else 2)
    return bytes(out)


def _turn_parameters(out: bytearray, content: bytes, at: int, end: int) -> None:
    """Turn the numbers in the entries from ``at`` on: names, offsets, and values by their type."""
    try:
        while at + 2 <= end and content[at]:
            length, group = struct.unpack_from("bb", content, at)
            link = at + 2 + abs(length)
            _turn(out, link, link + 2, 2)
            if group > 0:
                kind, count = struct.unpack_from("bB", content, link + 2)
                values = link + 4 + count
                number = 1
                for size in content[link + 4 : values]:
                    number *= size
                if abs(kind) > 1:
                    _turn(out, values, values + number * abs(kind), abs(kind))
            step = struct.unpack_from(">H", content, link)[0]
            if not step:
                return
            at = link + step
        if at + 2 > end:
            raise IndexError(at)
    except (struct.error, IndexError) as error:
        raise DataError(
            "the C3D file (MIPS) cannot be read: its parameter section has no end",
            expected="a whole C3D file",
        ) from error


def _turn(out: bytearray, start: int, end: int, width: int) -> None:
    """Turn the bytes of each number from ``start`` to ``end``; an incomplete one stays."""
    end = start + (min(end, len(out)) - start) // width * width
    part = out[start:end]
    for offset in range(width):
        out[start + offset : end : width] = part[width - 1 - offset :: width]
