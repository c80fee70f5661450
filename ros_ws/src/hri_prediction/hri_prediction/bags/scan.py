"""Reading an MCAP file from the front without trusting anything in it.

The index at the end of a file is missing after a crash, and a file can be cut or damaged
anywhere. This reader needs no index: it walks the records, checks every length and checksum, and
hands out what is whole. Where the way from record to record is lost, it goes on at the next whole
chunk. Of a chunk that is cut it decompresses as much as there is.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from hri_prediction.bags import mcap_file as layout
from hri_prediction.bags.chunks import MAX_CHUNK, Chunks, beginning
from hri_prediction.bags.fields import DAMAGE, Fields
from hri_prediction.errors import DataError
from hri_prediction.files.content import open_file

_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_FOOTER = struct.Struct("<BQQQI")
_PRIVATE = 0x80  # opcodes from here on are everybody's own
_TAKEN = (layout.SCHEMA, layout.CHANNEL, layout.ATTACHMENT, layout.METADATA)
_STEP = 1 << 12  # what going over a record costs, in bytes that could be unpacked in the meantime


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
        broken: Places where a record's own head was damaged; the scan went on at the next whole chunk.
        partial_messages: Messages recovered from the chunk in which the file ends; no checksum
            covers them.
        cut_bytes: Unpacked bytes of that chunk that are not there, by what it says of its size.
        cut_until_ns: Log time of its last message, by what it says itself [ns]; 0 when no chunk is cut.
        messages: All messages handed out.
        last_ns: Latest log time of these [ns], 0 when there is none.
        orphans: Messages without a known channel, not handed out.
        attachments: The attachments.
        serialized_metadata: rosbag2's metadata, empty when the file has none.
    """

    size: int = 0
    read: int = 0
    closed: bool = False
    chunks: int = 0
    damaged_chunks: int = 0
    broken: int = 0
    partial_messages: int = 0
    cut_bytes: int = 0
    cut_until_ns: int = 0
    messages: int = 0
    last_ns: int = 0
    orphans: int = 0
    attachments: list[ScannedAttachment] = field(default_factory=list)
    serialized_metadata: str = ""


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
        self._attached = 0  # bytes
        with open_file(path) as stream:
            try:
                self.result.size = os.fstat(stream.fileno()).st_size
                known = stream.read(len(layout.MAGIC)) == layout.MAGIC or _has_chunk(stream)
            except OSError as error:
                raise DataError(f"cannot read {path}: {error.strerror}") from error
        if not known:
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
        with (
            open_file(self.path) as stream,
            mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
        ):
            size = min(self.result.size, len(data))
            self._read_summary(data, size)
            yield from self._walk(data, size)

    def _walk(self, data: mmap.mmap, size: int) -> Iterator[ScannedMessage]:
        """Go from record to record; where that leads nowhere, to the next whole chunk."""
        result = self.result
        at = result.read = len(layout.MAGIC)
        sure = at  # the end of the last chunk that is whole: nothing before it is looked for again
        unsure = 0  # records since then
        chunks = Chunks(data, size)
        while True:
            record = _record_at(data, at, size)
            if record is None:
                chunk = chunks.find(sure)
                if chunk is None:
                    yield from self._cut_chunk(data, at, size)
                    return
                if chunk.begin < at:
                    chunks.wasted(at - chunk.begin + unsure * _STEP)
                result.broken += 1
            else:
                opcode, end = record
                if opcode == layout.FOOTER:
                    result.closed = data[end:size] == layout.MAGIC
                    result.read = size if result.closed else end
                    return
                chunk = chunks.whole(at) if opcode == layout.CHUNK else None
                if chunk is None:
                    yield from self._passed(opcode, data, at, end)
                    at = result.read = end
                    unsure += 1
                    continue
                result.broken += end != chunk.end
            result.chunks += 1
            unsure = 0
            yield from self._contents(chunk.records)
            at = sure = result.read = chunk.end

    def _passed(self, opcode: int, data: mmap.mmap, at: int, end: int) -> Iterator[ScannedMessage]:
        """Take in what stands at a place and is no whole chunk."""
        result = self.result
        if opcode == layout.CHUNK:
            result.damaged_chunks += 1
        elif opcode == layout.MESSAGE:
            # Not in a file with chunks: there it would be something else that looks like one.
            if not (result.chunks or result.damaged_chunks or result.broken):
                yield from self._message(data[at + _HEAD.size : end])
        elif opcode in _TAKEN:
            self._record(opcode, data[at + _HEAD.size : end])

    def _read_summary(self, data: mmap.mmap, size: int) -> None:
        """Take the topics from the index at the end: the chunk that introduces them may be damaged."""
        end = size - len(layout.MAGIC) - _FOOTER.size
        if end < len(layout.MAGIC) or data[size - len(layout.MAGIC) : size] != layout.MAGIC:
            return
        opcode, length, start, _, checksum = _FOOTER.unpack_from(data, end)
        if (opcode, length) != (layout.FOOTER, _FOOTER.size - _HEAD.size) or not 0 < start < end:
            return
        if checksum not in (0, zlib.crc32(data[start : end + _FOOTER.size - 4])):
            return
        while start < end and (record := _record_at(data, start, end)) is not None:
            opcode, stop = record
            if opcode in (layout.SCHEMA, layout.CHANNEL):
                self._record(opcode, data[start + _HEAD.size : stop], sure=True)
            start = stop

    def _record(self, opcode: int, body: bytes, *, sure: bool = False) -> None:
        """Take in a record that is no message; a damaged one is passed over.

        Args:
            opcode: Kind of the record.
            body: Its fields.
            sure: A checksum covers it. What is not sure does not take the place of what is known.
        """
        fields = Fields(body)
        try:
            if opcode == layout.SCHEMA:
                number = fields.number("H")
                name, encoding = fields.text(), fields.text()
                text = fields.blob(fields.number("I")).decode()
                if sure or number not in self._schemas:
                    self._schemas[number] = (name, encoding, text)
            elif opcode == layout.CHANNEL:
                number = fields.number("H")
                schema = self._schemas.get(fields.number("H"), ("", "", ""))
                topic, encoding = fields.text(), fields.text()
                channel = ScannedChannel(topic, *schema, encoding, fields.mapping())
                if sure or number not in self._channels:
                    self._channels[number] = channel
            elif opcode == layout.ATTACHMENT:
                fields.skip(16)
                name, media_type = fields.text(), fields.text()
                content = fields.blob(fields.number("Q"))
                checksum = fields.number("I")
                self._attached += len(content)
                # They do not overlap, unless a file is made so that they do, thousands of times.
                if checksum in (0, zlib.crc32(body[:-4])) and self._attached <= self.result.size:
                    attachment = ScannedAttachment(name, media_type, content)
                    self.result.attachments.append(attachment)
            elif opcode == layout.METADATA and fields.text() == "rosbag2":
                text = fields.mapping().get("serialized_metadata", "")
                self.result.serialized_metadata = text
        except DAMAGE:
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
        self.result.last_ns = max(self.result.last_ns, log_ns)
        yield ScannedMessage(channel, sequence, log_ns, publish_ns, body[_MESSAGE.size :])

    def _cut_chunk(self, data: mmap.mmap, at: int, size: int) -> Iterator[ScannedMessage]:
        """The messages at the beginning of a chunk in which the file ends."""
        if at + _HEAD.size > size or data[at] != layout.CHUNK:
            return
        result = self.result
        before = result.messages
        chunk = beginning(data[at + _HEAD.size : size])
        result.cut_bytes = max(chunk.size - len(chunk.records), 0)
        result.cut_until_ns = chunk.last_ns
        yield from self._contents(chunk.records)
        result.partial_messages = result.messages - before

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
                self._record(opcode, raw[at : at + length], sure=True)
            at += length


def _has_chunk(stream: BinaryIO) -> bool:
    """Whether a file whose first bytes are damaged holds a whole chunk."""
    if not stream.seek(0, os.SEEK_END):
        return False  # there is nothing to map
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        return Chunks(data, len(data)).find(0) is not None


def _record_at(data: mmap.mmap, at: int, size: int) -> tuple[int, int] | None:
    """Opcode and end of the record at a place; None when there is none that could be one."""
    if at + _HEAD.size > size:
        return None
    opcode, length = _HEAD.unpack_from(data, at)
    end = at + _HEAD.size + length
    known = layout.HEADER <= opcode <= layout.DATA_END or opcode >= _PRIVATE
    if not known or end > size or (opcode == layout.CHUNK and length >= MAX_CHUNK):
        return None
    if opcode == layout.FOOTER and not (
        length == _FOOTER.size - _HEAD.size and layout.MAGIC.startswith(data[end:size])
    ):
        return None
    return int(opcode), int(end)
