"""Whether a closed MCAP file is what it says, before the mcap package believes it.

That package reads what the index points to, as long as it says to be, and as often as the index points to
it. A few altered bytes make it ask for gigabytes. So lengths and index are compared with the file first;
what chunks hold is only looked at where the package would unpack it without limit.
"""

from __future__ import annotations

import contextlib
import mmap
import struct
from collections.abc import Iterator
from pathlib import Path

from hri_prediction.bags import mcap_file as layout
from hri_prediction.bags.chunks import check_frame, check_size
from hri_prediction.bags.condition import salvage_command
from hri_prediction.bags.fields import Fields
from hri_prediction.errors import DataError, cut
from hri_prediction.files.content import open_file

_HEAD = struct.Struct("<BQ")
_FIELDS = {
    layout.HEADER: "tt",
    layout.FOOTER: "QQI",
    layout.SCHEMA: "Httd",
    layout.CHANNEL: "HHttm",
    layout.MESSAGE: "HIQQ",
    layout.MESSAGE_INDEX: "Hd",
    layout.CHUNK_INDEX: "QQQQdQtQQ",
    layout.ATTACHMENT_INDEX: "QQQQQtt",
    layout.STATISTICS: "QHIIIIQQd",
    layout.METADATA: "tm",
    layout.METADATA_INDEX: "QQt",
    layout.SUMMARY_OFFSET: "BQQ",
    layout.DATA_END: "I",
}
"""Numbers as :mod:`struct` names them, texts, data with their length before them, mappings of texts."""
_POINTS_TO = {
    layout.CHUNK_INDEX: (2, layout.CHUNK),
    layout.ATTACHMENT_INDEX: (0, layout.ATTACHMENT),
    layout.METADATA_INDEX: (0, layout.METADATA),
}
"""Which field of an index says where a record is, and of which kind that is."""
_FRAME_HEADER = 64
"""More than the header of a compressed frame takes [bytes]."""


def is_closed(path: Path) -> bool:
    """Whether an MCAP file ends with its final magic, as a recorder that ended in order leaves it.

    Raises:
        DataError: the file cannot be read.
    """
    with open_file(path) as stream, reading(path):
        size = stream.seek(0, 2)
        if size < 2 * len(layout.MAGIC):
            return False
        stream.seek(-len(layout.MAGIC), 2)
        return stream.read() == layout.MAGIC


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever the mcap package raises on a damaged file into one DataError."""
    try:
        yield
    except DataError:
        raise
    except OSError as error:
        raise DataError(f"cannot read {path}: {error.strerror or error}") from error
    except Exception as error:  # the package raises errors of a dozen kinds
        raise DataError(
            f"{path} is damaged: {cut(' '.join(str(error).split())) or type(error).__name__}",
            hint=f"recover what is whole with: {salvage_command(path)}",
        ) from error


def check_structure(path: Path) -> None:
    """Check that all records are whole, and that the index points to each at most once.

    Raises:
        DataError: when the file cannot be read, or is not what it says.
    """
    with (
        open_file(path) as stream,
        reading(path),
        mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
    ):
        _walk(data)


def _walk(data: mmap.mmap) -> None:
    at, end = len(layout.MAGIC), len(data) - len(layout.MAGIC)
    there: dict[int, set[int]] = {opcode: set() for _, opcode in _POINTS_TO.values()}
    behind = 0  # the end of the data, where the summary begins
    footer: list[int] | None = None
    while footer is None:
        opcode, length = _HEAD.unpack_from(data, at)
        body = at + _HEAD.size
        if body + length > end:
            raise ValueError(f"the record at byte {at} reaches beyond the end")
        fields = Fields(data, body, body + length)
        numbers = _checked(opcode, fields)
        if opcode in there:
            there[opcode].add(at)
        elif opcode in _POINTS_TO:
            place, kind = _POINTS_TO[opcode]
            if numbers[place] not in there[kind]:
                raise ValueError(f"the index at byte {at} points to nothing, or to something twice")
            there[kind].remove(numbers[place])
        elif opcode == layout.DATA_END:
            behind = body + length
        elif opcode == layout.FOOTER:
            footer = numbers
        at = body + length
    if at != end or footer[0] not in (0, behind):
        raise ValueError("the end of the file does not point to its summary")


def _checked(opcode: int, fields: Fields) -> list[int]:
    """The numbers of a record that is as long as its fields."""
    if opcode == layout.CHUNK:
        _check_chunk(fields)
        return []
    if opcode == layout.ATTACHMENT:
        fields.skip(16)
        fields.text(), fields.text()
        fields.skip(fields.number("Q"))
        fields.skip(4)
        return []
    numbers = []
    for code in _FIELDS.get(opcode, ""):
        if code == "t":
            fields.text()
        elif code == "m":
            fields.mapping()
        elif code == "d":
            fields.skip(fields.number("I"))
        else:
            numbers.append(fields.number(code))
    return numbers


def _check_chunk(fields: Fields) -> None:
    fields.skip(16)
    size, _, compression = fields.number("Q"), fields.number("I"), fields.text()
    length = fields.number("Q")
    if length > fields.left:
        raise ValueError("a chunk that is longer than its record")
    check_size(size, length)
    if compression:
        seen = min(length, _FRAME_HEADER) if compression == "zstd" else length
        check_frame(compression, fields.blob(seen), size)
