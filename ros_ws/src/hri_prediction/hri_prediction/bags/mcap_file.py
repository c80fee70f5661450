"""An MCAP file that grows by whole chunks and is readable up to the last one, come what may.

The file format is described at https://mcap.dev/spec. The writer of the ``mcap`` package is not
used here for two reasons: after a write that failed (a full disk) its index no longer matches the
file, and it keeps the index of all chunks as objects (tens of MB in an hour). Here a chunk goes
to the operating system in one piece, a failed write is undone by truncation, and what was not
written stays in memory for another try.
"""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path

import zstandard

from hri_prediction.bags import durable
from hri_prediction.errors import DataError

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "hri_prediction.bags"

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = range(9, 14)
SUMMARY_OFFSET, DATA_END = 14, 15

_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<BQHIQQ")
_PAIR = struct.Struct("<QQ")
_CHANNEL_OFFSET = struct.Struct("<HQ")
_MESSAGE_FIELDS = 22  # channel id, sequence, log time, publish time


def _string(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _mapping(items: dict[str, str]) -> bytes:
    body = b"".join(_string(key) + _string(value) for key, value in items.items())
    return struct.pack("<I", len(body)) + body


def _record(opcode: int, body: bytes) -> bytes:
    return _RECORD.pack(opcode, len(body)) + body


class McapFile:
    """Append-only MCAP writer with profile ``ros2``, zstd chunks and message indexes.

    Args:
        path: File to create; it must not exist.
        chunk_bytes: Uncompressed size at which a chunk is full and should be flushed [bytes].
        compression_level: Level of zstd; 1 costs about 2 ms a megabyte.

    Raises:
        DataError: when the file cannot be created or the disk takes nothing.
    """

    def __init__(self, path: Path, *, chunk_bytes: int = 1 << 20, compression_level: int = 1):
        self.path = path
        self._chunk_bytes = chunk_bytes
        self._compressor = zstandard.ZstdCompressor(level=compression_level)
        self._schemas: list[bytes] = []
        self._channels: list[bytes] = []
        self._counts: list[int] = []
        self._definitions = bytearray()
        self._pending = bytearray()
        self._pending_index: dict[int, bytearray] = {}
        self._pending_counts: dict[int, int] = {}
        self._pending_start = 0
        self._pending_end = 0
        self._chunk_index = bytearray()
        self._chunk_count = 0
        self._attachment_index = bytearray()
        self._attachment_count = 0
        self._metadata_index = bytearray()
        self._metadata_count = 0
        self.start_ns = 0
        self.end_ns = 0
        self.message_count = 0
        try:
            self._fd = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise DataError(f"cannot create {path}: {error.strerror}") from error
        self._size = 0
        try:
            self._append(MAGIC + _record(HEADER, _string("ros2") + _string(LIBRARY)))
        except DataError:
            os.close(self._fd)
            raise

    @property
    def size(self) -> int:
        """Bytes that the operating system has."""
        return self._size

    @property
    def pending_messages(self) -> int:
        """Messages of the chunk in memory: what a ``kill -9`` loses."""
        return sum(self._pending_counts.values())

    @property
    def full(self) -> bool:
        """Whether the chunk in memory is as large as a chunk should be."""
        return len(self._pending) >= self._chunk_bytes

    @property
    def channel_counts(self) -> tuple[int, ...]:
        """Messages in the file for each channel, in the order of registration."""
        return tuple(self._counts)

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Register a message type; returns its number (from 1)."""
        number = len(self._schemas) + 1
        body = struct.pack("<H", number) + _string(name) + _string(encoding)
        record = _record(SCHEMA, body + struct.pack("<I", len(data)) + data)
        self._schemas.append(record)
        self._definitions += record
        self._pending += record
        return number

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        """Register a topic of a registered schema; returns its number (from 1)."""
        number = len(self._channels) + 1
        body = struct.pack("<HH", number, schema) + _string(topic) + _string("cdr")
        record = _record(CHANNEL, body + _mapping(metadata))
        self._channels.append(record)
        self._counts.append(0)
        self._definitions += record
        self._pending += record
        return number

    def add_message(
        self, channel: int, log_ns: int, publish_ns: int, data: bytes, sequence: int = 0
    ) -> None:
        """Add a message to the chunk in memory; see :attr:`full`."""
        offset = len(self._pending)
        if not self._pending_counts:
            self._pending_start = self._pending_end = log_ns
        elif log_ns < self._pending_start:
            self._pending_start = log_ns
        elif log_ns > self._pending_end:
            self._pending_end = log_ns
        index = self._pending_index.get(channel)
        if index is None:
            index = self._pending_index[channel] = bytearray()
            self._pending_counts[channel] = 0
        index += _PAIR.pack(log_ns, offset)
        self._pending_counts[channel] += 1
        self._pending += _MESSAGE.pack(
            MESSAGE, _MESSAGE_FIELDS + len(data), channel, sequence, log_ns, publish_ns
        )
        self._pending += data

    def flush(self) -> None:
        """Hand the chunk in memory to the operating system; :meth:`sync` hands it to the disk.

        Raises:
            DataError: the disk does not take it; the file is as before and the chunk is kept.
        """
        if not self._pending_counts:
            return
        raw = bytes(self._pending)
        packed = self._compressor.compress(raw)
        times = _PAIR.pack(self._pending_start, self._pending_end)
        head = times + struct.pack("<QI", len(raw), zlib.crc32(raw)) + _string("zstd")
        chunk = _record(CHUNK, head + struct.pack("<Q", len(packed)) + packed)
        # New topics stand before their first chunk as well as in it: when that chunk is damaged, and the
        # index is missing, the messages of all later chunks would else be of topics without a name.
        parts = [bytes(self._definitions), chunk]
        offsets = bytearray()
        start = self._size + len(self._definitions)
        position = start + len(chunk)
        for channel, entries in self._pending_index.items():
            body = struct.pack("<HI", channel, len(entries)) + entries
            parts.append(_record(MESSAGE_INDEX, body))
            offsets += _CHANNEL_OFFSET.pack(channel, position)
            position += len(parts[-1])
        self._append(b"".join(parts))
        self._chunk_index += _record(
            CHUNK_INDEX,
            times
            + _PAIR.pack(start, len(chunk))
            + struct.pack("<I", len(offsets))
            + offsets
            + struct.pack("<Q", position - start - len(chunk))
            + _string("zstd")
            + _PAIR.pack(len(packed), len(raw)),
        )
        self._chunk_count += 1
        first = self.message_count == 0
        self.start_ns = self._pending_start if first else min(self.start_ns, self._pending_start)
        self.end_ns = self._pending_end if first else max(self.end_ns, self._pending_end)
        for channel, count in self._pending_counts.items():
            self._counts[channel - 1] += count
            self.message_count += count
        self._definitions = bytearray()
        self._pending = bytearray()
        self._pending_index = {}
        self._pending_counts = {}

    def add_attachment(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Write a file into the file.

        Raises:
            DataError: the disk does not take it.
        """
        label = _string(name) + _string(media_type)
        body = _PAIR.pack(time_ns, time_ns) + label + struct.pack("<Q", len(data)) + data
        record = _record(ATTACHMENT, body + struct.pack("<I", zlib.crc32(body)))
        start = self._size
        self._append(record)
        index = struct.pack("<QQQQQ", start, len(record), time_ns, time_ns, len(data)) + label
        self._attachment_index += _record(ATTACHMENT_INDEX, index)
        self._attachment_count += 1

    def add_metadata(self, name: str, items: dict[str, str]) -> None:
        """Write a named mapping into the file.

        Raises:
            DataError: the disk does not take it.
        """
        record = _record(METADATA, _string(name) + _mapping(items))
        start = self._size
        self._append(record)
        self._metadata_index += _record(
            METADATA_INDEX, _PAIR.pack(start, len(record)) + _string(name)
        )
        self._metadata_count += 1

    def discard_pending(self) -> int:
        """Give up the chunk in memory; returns how many messages are lost by that."""
        lost = self.pending_messages
        self._pending = bytearray()
        self._pending_index = {}
        self._pending_counts = {}
        return lost

    def sync(self) -> None:
        """Have the disk take what the operating system has, so that a power cut does not lose it.

        Raises:
            DataError: the disk did not take some of it; which part is not known.
        """
        try:
            durable.sync(self._fd)
        except OSError as error:
            raise DataError(
                f"the disk did not take what was written to {self.path}: {error.strerror}",
                hint="look at the disk's health, and salvage the bag when it cannot be read",
            ) from error

    def finish(self) -> None:
        """Write the index and close the file; the chunk in memory must be flushed or discarded.

        Raises:
            DataError: the disk does not take the index. The file stays readable by salvage.
        """
        try:
            self._append(self._tail())
            self.sync()
        finally:
            self.release()

    def release(self) -> None:
        """Close the file as it is, without an index (as a crash would leave it)."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _tail(self) -> bytes:
        data_end = _record(DATA_END, struct.pack("<I", 0))
        start = self._size + len(data_end)
        counts = b"".join(
            _CHANNEL_OFFSET.pack(number + 1, count) for number, count in enumerate(self._counts)
        )
        statistics = _record(
            STATISTICS,
            struct.pack(
                "<QHIIIIQQI",
                self.message_count,
                len(self._schemas),
                len(self._channels),
                self._attachment_count,
                self._metadata_count,
                self._chunk_count,
                self.start_ns,
                self.end_ns,
                len(counts),
            )
            + counts,
        )
        groups = (
            (SCHEMA, b"".join(self._schemas)),
            (CHANNEL, b"".join(self._channels)),
            (STATISTICS, statistics),
            (CHUNK_INDEX, bytes(self._chunk_index)),
            (ATTACHMENT_INDEX, bytes(self._attachment_index)),
            (METADATA_INDEX, bytes(self._metadata_index)),
        )
        summary = bytearray()
        offsets = bytearray()
        for opcode, group in groups:
            if group:
                body = struct.pack("<BQQ", opcode, start + len(summary), len(group))
                offsets += _record(SUMMARY_OFFSET, body)
                summary += group
        offset_start = start + len(summary)
        summary += offsets
        footer = struct.pack("<BQQQ", FOOTER, 20, start, offset_start)
        crc = zlib.crc32(footer, zlib.crc32(summary))
        return data_end + bytes(summary) + footer + struct.pack("<I", crc) + MAGIC

    def _append(self, data: bytes) -> None:
        """Write all of ``data``, or nothing."""
        if self._fd < 0:
            raise DataError(f"{self.path} is closed already")
        try:
            view = memoryview(data)
            while view:
                view = view[os.write(self._fd, view) :]
        except OSError as error:
            os.ftruncate(self._fd, self._size)
            os.lseek(self._fd, self._size, os.SEEK_SET)
            raise DataError(
                f"cannot write to {self.path}: {error.strerror}",
                hint="free some disk space; what is recorded so far stays readable",
            ) from error
        self._size += len(data)
