"""A cursor over the fields of an MCAP record, which trusts no length in it."""

from __future__ import annotations

import mmap
import struct

import zstandard

DAMAGE = (struct.error, UnicodeDecodeError, ValueError, RuntimeError, zstandard.ZstdError)
"""What reading a damaged record can raise."""


class Fields:
    """Reads one field after the other; ``struct.error`` where the record is too short for one.

    Args:
        data: What the record is in.
        at: Where its body begins.
        end: And where it ends; none: where the data end.
    """

    def __init__(self, data: bytes | mmap.mmap, at: int = 0, end: int | None = None) -> None:
        self._data = data
        self._end = len(data) if end is None else end
        self.at = at

    @property
    def left(self) -> int:
        """Bytes behind the last field that was read."""
        return self._end - self.at

    def number(self, layout: str) -> int:
        """A number, little-endian, as :mod:`struct` names it."""
        start = self.skip(struct.calcsize("<" + layout))
        return int(struct.unpack_from("<" + layout, self._data, start)[0])

    def blob(self, length: int) -> bytes:
        """So many bytes."""
        start = self.skip(length)
        return self._data[start : self.at]

    def text(self) -> str:
        """A text with its length before it; ``UnicodeDecodeError`` when it is none."""
        return self.blob(self.number("I")).decode()

    def mapping(self) -> dict[str, str]:
        """Texts by name."""
        length = self.number("I")
        start = self.skip(length)
        inner = Fields(self._data, start, self.at)
        items = {}
        while inner.left:
            key = inner.text()
            items[key] = inner.text()
        return items

    def skip(self, length: int) -> int:
        """Go on behind so many bytes; returns where they begin."""
        start = self.at
        if length > self.left:
            raise struct.error("body too short")
        self.at += length
        return start
