"""Reading an MCAP file from the front without trusting anything in it.

The index at the end of a file is missing after a crash, and a file can be cut or damaged
anywhere. This reader needs no index: it walks the records, checks every length and checksum, and
hands out what is whole. Of a chunk that is cut it decompresses as much as there is.
"""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from hri_prediction.bags import mcap_file as layout
from hri_prediction.errors import DataError

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_MAX_CHUNK = 1 << 31  # a larger chunk is taken for damage [bytes]


@dataclass(frozen=True)
class ScannedChannel:
    """A topic as the file describes it: see the MCAP specification."""

    topic: str
    type: str
    encoding: str
    definition: str
    message_encoding: str
    metadata: dict[str, str]


@dataclass(frozen=True)
class ScannedMessage:
    """One message: serialised data, times in ns."""

    channel: ScannedChannel
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


@dataclass(frozen=True)
class ScannedAttachment:
    """A file within the file."""

    name: str
    media_type: str
    data: bytes


@dataclass
class ScanResult:
    """What a scan found; complete when the scan's iterator has ended.

    Attributes:
        size: Size of the file [bytes].
        read: Position up to which records are whole [bytes].
        closed: The file ends as it should: index, footer and final magic are there.
        chunks: Whole chunks.
        damaged_chunks: Chunks whose checksum or compression is wrong; they were passed over.
        partial_messages: Messages recovered from the chunk in which the file ends.
        messages: All messages handed out.
        orphans: Messages without a known channel, not handed out.
        attachments: The attachments.
        serialized_metadata: rosbag2's metadata, empty when the file has none.
    """

    size: int = 0
    read: int = 0
    closed: bool = False
    chunks: int = 0
    damaged_chunks: int = 0
    partial_messages: int = 0
    messages: int = 0
    orphans: int = 0
    attachments: list[ScannedAttachment] = field(default_factory=list)
    serialized_metadata: str = ""


class _Fields:
    """Cursor over the body of a record; runs into ``struct.error`` where the body is too short."""

    def __init__(self, body: bytes | memoryview) -> None:
        self._body = bytes(body)
        self._at = 0

    def number(self, layout_: str) -> int:
        value = struct.unpack_from("<" + layout_, self._body, self._at)[0]
        self._at += struct.calcsize("<" + layout_)
        return int(value)

    def blob(self, length: int) -> bytes:
        if self._at + length > len(self._body):
            raise struct.error("body too short")
        data = self._body[self._at : self._at + length]
        self._at += length
        return data

    def text(self) -> str:
        return self.blob(self.number("I")).decode()

    def mapping(self) -> dict[str, str]:
        inner = _Fields(self.blob(self.number("I")))
        items = {}
        while inner._at < len(inner._body):
            key = inner.text()
            items[key] = inner.text()
        return items


_DAMAGE = (struct.error, UnicodeDecodeError, ValueError, RuntimeError, zstandard.ZstdError)


class Scan:
    """Walks one MCAP file; iterate over it once.

    Args:
        path: The file.

    Raises:
        DataError: the file cannot be read, or is no MCAP file at all.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.result = ScanResult()
        self._schemas: dict[int, tuple[str, str, str]] = {}
        self._channels: dict[int, ScannedChannel] = {}
        try:
            with path.open("rb") as stream:
                self.result.size = path.stat().st_size
                magic = stream.read(len(layout.MAGIC))
        except OSError as error:
            raise DataError(f"cannot read {path}: {error.strerror}") from error
        if magic != layout.MAGIC:
            raise DataError(
                f"{path} is no MCAP file",
                expected="the MCAP magic at its beginning",
                hint="it is empty or of another kind",
            )

    @property
    def channels(self) -> tuple[ScannedChannel, ...]:
        """Topics found up to now."""
        return tuple(self._channels.values())

    def __iter__(self) -> Iterator[ScannedMessage]:
        result = self.result
        with (
            self.path.open("rb") as stream,
            mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
        ):
            at = result.read = len(layout.MAGIC)
            size = min(result.size, len(data))
            while at + _HEAD.size <= size:
                opcode, length = _HEAD.unpack_from(data, at)
                body = at + _HEAD.size
                if opcode == 0:
                    break
                if body + length > size:
                    if opcode == layout.CHUNK:
                        yield from self._partial_chunk(data[body:size])
                    break
                if opcode == layout.FOOTER:
                    end = body + length
                    result.closed = data[end:size] == layout.MAGIC
                    result.read = size if result.closed else end
                    break
                if opcode == layout.CHUNK and length < _MAX_CHUNK:
                    yield from self._chunk(data[body : body + length])
                elif opcode == layout.MESSAGE:
                    yield from self._message(data[body : body + length])
                else:
                    self._record(opcode, data[body : body + length])
                at = result.read = body + length

    def _record(self, opcode: int, body: bytes) -> None:
        """Take in a record that is no message; a damaged one is passed over."""
        fields = _Fields(body)
        try:
            if opcode == layout.SCHEMA:
                number = fields.number("H")
                name, encoding = fields.text(), fields.text()
                text = fields.blob(fields.number("I")).decode()
                self._schemas[number] = (name, encoding, text)
            elif opcode == layout.CHANNEL:
                number = fields.number("H")
                schema = self._schemas.get(fields.number("H"), ("", "", ""))
                topic, encoding = fields.text(), fields.text()
                self._channels[number] = ScannedChannel(topic, *schema, encoding, fields.mapping())
            elif opcode == layout.ATTACHMENT:
                fields.blob(16)
                name, media_type = fields.text(), fields.text()
                content = fields.blob(fields.number("Q"))
                checksum = fields.number("I")
                if checksum in (0, zlib.crc32(body[:-4])):
                    attachment = ScannedAttachment(name, media_type, content)
                    self.result.attachments.append(attachment)
            elif opcode == layout.METADATA and fields.text() == "rosbag2":
                text = fields.mapping().get("serialized_metadata", "")
                self.result.serialized_metadata = text
        except _DAMAGE:
            return

    def _message(self, body: bytes) -> Iterator[ScannedMessage]:
        if len(body) < _MESSAGE.size:
            return
        number, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(body)
        channel = self._channels.get(number)
        if channel is None:
            self.result.orphans += 1
            return
        self.result.messages += 1
        yield ScannedMessage(channel, sequence, log_ns, publish_ns, body[_MESSAGE.size :])

    def _chunk(self, body: bytes) -> Iterator[ScannedMessage]:
        try:
            size, checksum, compression, packed = self._chunk_fields(body)
            raw = _decompress(compression, packed, size)
            if len(raw) != size or checksum not in (0, zlib.crc32(raw)):
                raise ValueError("wrong checksum")
        except _DAMAGE:
            self.result.damaged_chunks += 1
            return
        self.result.chunks += 1
        yield from self._contents(raw)

    def _partial_chunk(self, body: bytes) -> Iterator[ScannedMessage]:
        try:
            _, _, compression, packed = self._chunk_fields(body, whole=False)
            raw = _decompress_partly(compression, packed)
        except _DAMAGE:
            return
        before = self.result.messages
        yield from self._contents(raw)
        self.result.partial_messages = self.result.messages - before

    @staticmethod
    def _chunk_fields(body: bytes, *, whole: bool = True) -> tuple[int, int, str, bytes]:
        fields = _Fields(body)
        fields.blob(16)
        size, checksum, compression = fields.number("Q"), fields.number("I"), fields.text()
        length = fields.number("Q")
        if size > _MAX_CHUNK:
            raise ValueError("implausible size")
        return size, checksum, compression, fields.blob(length) if whole else body[fields._at :]

    def _contents(self, raw: bytes) -> Iterator[ScannedMessage]:
        """The messages of a decompressed chunk, up to the last whole record."""
        at = 0
        while at + _HEAD.size <= len(raw):
            opcode, length = _HEAD.unpack_from(raw, at)
            at += _HEAD.size
            if at + length > len(raw):
                return
            if opcode == layout.MESSAGE:
                yield from self._message(raw[at : at + length])
            else:
                self._record(opcode, raw[at : at + length])
            at += length


def _decompress(compression: str, packed: bytes, size: int) -> bytes:
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    if compression == "lz4":
        return bytes(lz4.frame.decompress(packed))
    if compression:
        raise ValueError(f"unknown compression {compression}")
    return packed


def _decompress_partly(compression: str, packed: bytes) -> bytes:
    """As much of a cut chunk as its complete blocks hold."""
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompressobj().decompress(packed)
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed))
    if compression:
        raise ValueError(f"unknown compression {compression}")
    return packed
