"""Closed files are taken as other programs write them, and refused when they are not what they say."""

from __future__ import annotations

import mmap
import struct
import time
import zlib
from pathlib import Path
from random import Random

import lz4.frame
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, salvage
from hri_prediction.bags.chunks import Chunks, WholeChunk, beginning, check_frame, decompressed
from hri_prediction.bags.fields import DAMAGE, Fields
from hri_prediction.bags.mcap_file import MAGIC
from hri_prediction.bags.scan import Scan
from hri_prediction.bags.structure import check_structure, is_closed
from hri_prediction.errors import DataError

STEP_NS = 1_000_000


def other_file(path: Path, **options) -> list[tuple[str, bytes, int]]:
    """A file as the mcap package's own writer writes it; returns its messages."""
    rows = []
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=500, **options)
        writer.start("ros2", "other")
        schema = writer.register_schema("std_msgs/msg/UInt64", "ros2msg", b"uint64 data\n")
        channels = [writer.register_channel(f"/t{i}", "cdr", schema) for i in range(2)]
        writer.add_attachment(0, 0, "notes.txt", "text/plain", b"hello")
        writer.add_metadata("about", {"a": "b"})
        for index in range(60):
            data = b"\x00\x01\x00\x00" + struct.pack("<Q", index)
            writer.add_message(channels[index % 2], index * STEP_NS, data, index * STEP_NS, index)
            rows.append((f"/t{index % 2}", data, index * STEP_NS))
        writer.finish()
    return rows


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("use_chunking", [True, False])
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.NONE])
@pytest.mark.parametrize("checked", [True, False])
def test_files_of_another_writer(
    tmp_path: Path, compression, use_chunking: bool, index_types, checked: bool
) -> None:
    path = tmp_path / "a.mcap"
    rows = other_file(
        path,
        compression=compression,
        use_chunking=use_chunking,
        index_types=index_types,
        use_summary_offsets=checked,
        enable_data_crcs=checked,
    )
    assert is_closed(path)
    check_structure(path)
    reader = BagReader(path)
    assert [(m.topic, m.data, m.log_time_ns) for m in reader.messages()] == rows
    if index_types is IndexType.ALL:  # without an index of them, they are not looked for
        assert [(item.name, item.data) for item in reader.attachments()] == [
            ("notes.txt", b"hello")
        ]
    report = salvage(path, tmp_path / "out")
    assert report.metadata.message_count == len(rows)


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    """A file of three chunks and an attachment."""
    with BagWriter(tmp_path / "run", chunk_bytes=400) as writer:
        writer.add_attachment("notes.txt", "text/plain", b"hello")
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
        for index in range(20):
            writer.write(channel, b"\x00\x01\x00\x00" + struct.pack("<Q", index), index)
    return tmp_path / "run" / "run_0.mcap"


def test_each_record_is_pointed_to_once(whole: Path) -> None:
    check_structure(whole)
    data = whole.read_bytes()
    footer = data.rindex(struct.pack("<BQ", 2, 20))
    (start,) = struct.unpack_from("<Q", data, footer + 9)
    whole.write_bytes(data[:start] + 2 * data[start:footer] + data[footer:])
    with pytest.raises(
        DataError, match=r"is damaged: the index at byte .* twice; recover .*--salvage"
    ):
        check_structure(whole)
    assert len(list(BagReader(whole, allow_unclosed=True).files)) == 1
    with pytest.raises(DataError, match="is damaged: the index"):
        list(BagReader(whole).messages())


@pytest.mark.parametrize(
    ("opcode", "at", "layout", "value", "match"),
    [
        (6, 16, "<Q", 2**40, "a chunk of .* bytes that says it holds 1099511627776"),
        (6, 16, "<Q", 7, "says it holds 7 bytes, and holds others"),
        (6, 36, "<Q", 2**62, "longer than its record"),
        (9, 16, "<I", 2**31, "body too short"),
        (8, 16, "<Q", 3, "points to nothing"),
        (2, 0, "<Q", 8, "does not point to its summary"),
        (4, 4, "<I", 2**32 - 1, "body too short"),
    ],
)
def test_lengths_that_lie(
    whole: Path, opcode: int, at: int, layout: str, value: int, match: str
) -> None:
    data = bytearray(whole.read_bytes())
    place = 8
    while data[place] != opcode:
        place += 9 + struct.unpack_from("<Q", data, place + 1)[0]
    struct.pack_into(layout, data, place + 9 + at, value)
    whole.write_bytes(data)
    with pytest.raises(DataError, match=f"run_0.mcap is damaged: .*{match}"):
        check_structure(whole)


def packed_ways(raw: bytes) -> tuple[tuple[str, bytes], ...]:
    """The same, as chunks can hold it."""
    return (("zstd", zstandard.compress(raw)), ("lz4", lz4.frame.compress(raw)), ("", raw))


def chunk_body(how: str, packed: bytes, size: int, checksum: int = 0) -> bytes:
    """Of a chunk record."""
    head = bytes(16) + struct.pack("<QII", size, checksum, len(how)) + how.encode()
    return head + struct.pack("<Q", len(packed)) + packed


def test_chunks_become_what_they_say() -> None:
    raw = bytes(range(256)) * 4000
    for how, packed in packed_ways(raw):
        check_frame(how, packed, len(raw))
        assert decompressed(how, packed, len(raw)) == raw
        for size in (1000, len(raw) - 1, len(raw) + 1):
            with pytest.raises(ValueError, match=f"holds {size} bytes, and holds others"):
                check_frame(how, packed, size)
            with pytest.raises(ValueError, match=f"holds {size} bytes, and holds others"):
                decompressed(how, packed, size)
        for other in (packed[:-1], packed + b"\x00"):
            with pytest.raises(DAMAGE):
                decompressed(how, other, len(raw))
    with pytest.raises(ValueError, match="unknown compression bz2"):
        decompressed("bz2", raw, len(raw))
    with pytest.raises(ValueError, match="a chunk of 10 bytes that says it holds"):
        decompressed("zstd", bytes(10), 1 << 30)


def test_a_frame_that_does_not_say_its_size() -> None:
    raw = bytes(range(256)) * 4000
    frame = zstandard.ZstdCompressor(write_content_size=False).compress(raw)
    check_frame("zstd", frame, len(raw))
    assert decompressed("zstd", frame, len(raw)) == raw
    for size in (len(raw) - 1, len(raw) + 1):
        with pytest.raises(DAMAGE):
            decompressed("zstd", frame, size)


def test_a_chunk_that_is_cut_gives_what_there_is() -> None:
    raw = Random(1).randbytes(600_000)
    for how, packed in packed_ways(raw):
        body = chunk_body(how, packed, len(raw))
        found = beginning(body[: len(body) // 2]).records
        assert found == raw[: len(found)]
        assert len(found) > 100_000
        assert beginning(body).records == raw
        assert len(beginning(chunk_body(how, packed, 1000)).records) <= 1000 or not how
        assert beginning(chunk_body(how, packed[:10], 1 << 40)).records == b""


def mapped(path: Path, data: bytes) -> mmap.mmap:
    """A file with these bytes."""
    path.write_bytes(data)
    with path.open("rb") as stream:
        return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)


@pytest.mark.parametrize("how", ["zstd", "lz4", ""])
def test_whole_chunks_are_found(tmp_path: Path, how: str) -> None:
    raw = bytes(range(256)) * 40
    packed = dict(packed_ways(raw))[how]
    body = chunk_body(how, packed, len(raw), zlib.crc32(raw))
    chunk = b"\x06" + struct.pack("<Q", len(body)) + body
    wrong = bytearray(chunk)
    wrong[28] ^= 1  # a bit of the checksum
    before = b"\x06" * 100 + bytes(wrong) + bytes(50)
    data = before + chunk + bytes(20)
    with mapped(tmp_path / "a", data) as found:
        chunks = Chunks(found, len(data))
        assert chunks.whole(100) is None
        assert chunks.find(0) == WholeChunk(len(before), len(before) + len(chunk), raw)
        assert chunks.whole(len(before)) == chunks.find(0)
        assert chunks.find(len(before) + 1) is None
        assert Chunks(found, len(data) - 21).find(0) is None  # cut
        # Whatever is whole may be taken any number of times; what is not, has an end.
        chunks.wasted(1 << 30)
        assert chunks.whole(len(before)) is None


def test_chunks_within_chunks_are_not_tried_for_ever(tmp_path: Path) -> None:
    """Each of these heads tells of a chunk of all that follows: tried, they are gigabytes."""
    size, step = 2_000_000, 49
    data = bytearray()
    while len(data) < size - step:
        left = size - len(data) - step
        data += b"\x06" + struct.pack("<Q", left + step - 9) + bytes(16)
        data += struct.pack("<QIIQ", left, 1, 0, left)
    data += bytes(size - len(data))
    begin = time.monotonic()
    with mapped(tmp_path / "a", bytes(data)) as found:
        assert Chunks(found, len(data)).find(0) is None
    assert time.monotonic() - begin < 5.0
    data[33:37] = bytes(4)  # without its checksum, the first is believed
    with mapped(tmp_path / "b", bytes(data)) as found:
        chunk = Chunks(found, len(data)).find(0)
        assert chunk == WholeChunk(0, size, bytes(data[step:]))


def test_ways_back_have_an_end(tmp_path: Path) -> None:
    """Damage that leads far ahead, behind every chunk: what was gone over is not gone over for ever."""
    tiny = chunk_body("", b"", 0)
    tiny = b"\x06" + struct.pack("<Q", len(tiny)) + tiny
    note = bytes(16) + struct.pack("<I", 1) + b"a" + struct.pack("<IQ", 0, 20_000) + bytes(20_004)
    far = b"\x09" + struct.pack("<Q", len(note)) + note
    far += (b"\x80" + bytes(8)) * 30_000
    count = 10_000
    step = 9 + len(tiny)
    ahead = b"".join(
        b"\x80" + struct.pack("<Q", (count - number) * step - 9) + tiny for number in range(count)
    )
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + ahead + far + b"\x00" * 9)
    begin = time.monotonic()
    scan = Scan(path)
    assert list(scan) == []
    assert time.monotonic() - begin < 5.0
    assert 1 < scan.result.broken < count
    assert sum(len(one.data) for one in scan.result.attachments) <= scan.result.size


def test_fields() -> None:
    data = (
        b"\x05\x00\x03\x00\x00\x00abc"
        + struct.pack("<I", 11)
        + b"\x01\x00\x00\x00a\x02\x00\x00\x00bc"
    )
    fields = Fields(data)
    assert (fields.number("H"), fields.text(), fields.mapping(), fields.left) == (
        5,
        "abc",
        {"a": "bc"},
        0,
    )
    with pytest.raises(struct.error):
        fields.number("B")
    with pytest.raises(struct.error):
        Fields(data, 2, 8).text()
