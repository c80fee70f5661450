"""Chunks of an MCAP file that may be damaged, or made to do harm: checked, decompressed, and found again.

What a chunk says of its size is not believed before it is known to be so. The length of a record stands
before it, without a checksum: where one is wrong, all that follows seems to be lost. Chunks are found again
by how they begin, and believed when their checksum is right.
"""

from __future__ import annotations

import mmap
import re
import zlib
from dataclasses import dataclass

import lz4.frame
import zstandard

from hri_prediction.bags.fields import DAMAGE, Fields

MAX_CHUNK = 1 << 31
"""A larger chunk is taken for damage [bytes]."""
_USUAL = 1 << 26
"""Chunks of up to this size are believed; writers make them of one megabyte, or of one message [bytes]."""
_RATIO = 64
"""Larger ones too, if they are no more than so many times what they take in the file."""
_IN_VAIN = 1 << 28
"""What may be tried in vain in a file, however small [bytes]."""
_RECORD_HEAD = 9  # opcode, length
_FRAMES = {"zstd": b"\x28\xb5\x2f\xfd", "lz4": b"\x04\x22\x4d\x18"}
_MAGIC = 4
_BEGIN = re.compile(
    rb"\x06.{8}"  # opcode of a chunk, length
    rb".{16}.{4}\x00{4}.{4}"  # first and last time, uncompressed size, checksum
    rb"(?:\x04\x00{3}zstd|\x03\x00{3}lz4|\x00{4})",
    re.DOTALL,
)


def check_size(size: int, packed: int) -> None:
    """Whether a chunk may become as large as it says.

    Args:
        size: What it says that it becomes [bytes].
        packed: What it takes in the file [bytes].

    Raises:
        ValueError: when it may not.
    """
    if size > min(max(_USUAL, _RATIO * packed), MAX_CHUNK):
        raise ValueError(f"a chunk of {packed} bytes that says it holds {size}")


def check_frame(compression: str, packed: bytes, size: int) -> None:
    """Whether a compressed chunk becomes as large as it says, before anything else unpacks it.

    Args:
        compression: As MCAP names it.
        packed: The compressed chunk; of a zstd frame its header is enough.
        size: What it says that it becomes [bytes].

    Raises:
        One of ``DAMAGE``: when it does not.
    """
    if compression != "zstd":
        decompressed(compression, packed, size)
    # It unpacks to what its frame says, or to no more than the chunk says where that says nothing.
    elif zstandard.frame_content_size(packed) not in (-1, size):
        raise _other_size(size)


def decompressed(compression: str, packed: bytes, size: int) -> bytes:
    """A whole chunk of so many bytes, whose frame must fill it: behind it there may be other chunks.

    Raises:
        One of ``DAMAGE``: when it is damaged, of another size, or says to be larger than it may be.
    """
    check_size(size, len(packed))
    if compression == "zstd":
        # What the frame says of its size is believed by the decompressor, which would make room for it.
        check_frame(compression, packed, size)
        unpacker = zstandard.ZstdDecompressor()
        raw = unpacker.decompress(packed, max_output_size=size, allow_extra_data=False)
    elif compression == "lz4":
        frame = lz4.frame.LZ4FrameDecompressor()
        # One byte more than there should be shows that there is more.
        raw = bytes(frame.decompress(packed, max_length=size + 1))
        if len(raw) <= size and (not frame.eof or frame.unused_data):
            raise ValueError("the frame does not end where its chunk does")
    else:
        raw = _plain(compression, packed)
    if len(raw) != size:
        raise _other_size(size)
    return raw


@dataclass(frozen=True)
class CutChunk:
    """A chunk in which a file ends; no checksum covers any of it.

    Attributes:
        size: What it held, unpacked, by what it says itself; 0 when not even that is there [bytes].
        last_ns: Log time of its last message, likewise [ns].
        records: What is there of it.
    """

    size: int = 0
    last_ns: int = 0
    records: bytes = b""


def beginning(body: bytes) -> CutChunk:
    """What can be told of a chunk in which the file ends.

    Args:
        body: The beginning of the body of the chunk record.
    """
    try:
        fields = Fields(body)
        chunk = _head(fields)
        packed = fields.blob(fields.left)
    except DAMAGE:
        return CutChunk()
    return CutChunk(chunk.size, chunk.last_ns, _cut_records(chunk, packed))


def _cut_records(chunk: _Head, packed: bytes) -> bytes:
    try:
        check_size(chunk.size, len(packed))
        if chunk.compression == "zstd":
            return zstandard.ZstdDecompressor().stream_reader(packed).read(chunk.size)
        if chunk.compression == "lz4":
            frame = lz4.frame.LZ4FrameDecompressor()
            return bytes(frame.decompress(packed, max_length=chunk.size))
        return _plain(chunk.compression, packed)
    except DAMAGE:
        return b""


@dataclass(frozen=True)
class WholeChunk:
    """One whose checksum is right, or that has none: where it begins and ends, and the records in it."""

    begin: int
    end: int
    records: bytes


class Chunks:
    """The whole chunks of a file, wherever they are.

    What only looks like a chunk is unpacked in vain, and may lie within another that does: a file can be
    made so that this has no end. So no more is tried in vain than damage costs: some hundred megabytes, and
    so many times the file. Behind that nothing is whole.

    Args:
        data: The file.
        size: Where it ends [bytes].
    """

    def __init__(self, data: mmap.mmap, size: int) -> None:
        self._data = data
        self._size = size
        self._left = _IN_VAIN + _RATIO * size

    def whole(self, at: int) -> WholeChunk | None:
        """The chunk at a place; None when it is cut, or its checksum is wrong.

        The length of its record is not looked at, which may be what is wrong: a chunk knows its own.

        Args:
            at: Where the record begins [bytes].
        """
        if self._left < 0 or _BEGIN.match(self._data, at, self._size) is None:
            return None
        fields = Fields(self._data, at + _RECORD_HEAD, self._size)
        try:
            chunk = _head(fields)
            if not _plausible(chunk, self._data[fields.at : fields.at + _MAGIC], fields.left):
                return None
            check_size(chunk.size, chunk.length)
            self.wasted(chunk.length + chunk.size)
            raw = decompressed(chunk.compression, fields.blob(chunk.length), chunk.size)
        except DAMAGE:
            return None
        if chunk.checksum not in (0, zlib.crc32(raw)):
            return None
        self.wasted(-chunk.length - chunk.size)  # it was not in vain
        return WholeChunk(at, fields.at, raw)

    def find(self, start: int) -> WholeChunk | None:
        """The next chunk that is whole.

        Args:
            start: Where to begin [bytes].
        """
        while (match := _BEGIN.search(self._data, start, self._size)) is not None:
            if (chunk := self.whole(match.start())) is not None:
                return chunk
            start = match.start() + 1
        return None

    def wasted(self, size: int) -> None:
        """Bytes that were gone through in vain."""
        self._left -= size


@dataclass(frozen=True)
class _Head:
    """Of a chunk: last log time, unpacked size, its CRC-32 (0: not known), length of the packed records."""

    last_ns: int
    size: int
    checksum: int
    compression: str
    length: int


def _head(fields: Fields) -> _Head:
    fields.skip(8)
    last_ns, size, checksum = fields.number("Q"), fields.number("Q"), fields.number("I")
    return _Head(last_ns, size, checksum, fields.text(), fields.number("Q"))


def _plausible(chunk: _Head, begin: bytes, left: int) -> bool:
    """Whether it is worth the while to unpack what begins so, with so many bytes behind it."""
    same = bool(chunk.compression) or chunk.size == chunk.length
    return same and chunk.length <= left and begin.startswith(_FRAMES.get(chunk.compression, b""))


def _plain(compression: str, packed: bytes) -> bytes:
    if compression:
        raise ValueError(f"unknown compression {compression:.40}")
    return packed


def _other_size(size: int) -> ValueError:
    return ValueError(f"a chunk that says it holds {size} bytes, and holds others")
