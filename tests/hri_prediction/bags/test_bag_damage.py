"""Files with bytes that are missing or wrong, anywhere: every whole chunk comes back."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, inspect_bag, salvage
from hri_prediction.bags.scan import Scan
from hri_prediction.errors import DataError

Row = tuple[str, bytes, int]


@dataclass(frozen=True)
class Sample:
    """A whole file: its bytes, its messages, and of each chunk where it lies and what is in it."""

    data: bytes
    rows: tuple[Row, ...]
    chunks: tuple[tuple[int, int, tuple[Row, ...]], ...]

    def whole(self, damaged: set[int], size: int) -> set[Row]:
        """Messages of the chunks that end before ``size`` and have none of these bytes."""
        return {
            row
            for begin, end, rows in self.chunks
            if end <= size and damaged.isdisjoint(range(begin, end))
            for row in rows
        }


def read_sample(file: Path, rows: list[Row]) -> Sample:
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    found = []
    for index in summary.chunk_indexes:
        begin, end = index.chunk_start_offset, index.chunk_start_offset + index.chunk_length
        span = range(index.message_start_time, index.message_end_time + 1)
        found.append((begin, end, tuple(row for row in rows if row[2] in span)))
    return Sample(file.read_bytes(), tuple(rows), tuple(found))


def some_rows(count: int) -> list[Row]:
    return [
        (f"/t{index % 3}", b"\x00\x01\x00\x00" + (index * 7919).to_bytes(8, "little"), 1000 + index)
        for index in range(count)
    ]


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    folder = tmp_path_factory.mktemp("whole") / "run"
    rows = some_rows(400)
    with BagWriter(folder, chunk_bytes=1500) as writer:
        channels = {t: writer.add_topic(TopicInfo(t, "std_msgs/msg/UInt64")) for t in
                    ("/t0", "/t1", "/t2")}  # fmt: skip
        for topic, data, time in rows:
            writer.write(channels[topic], data, time)
    return read_sample(folder / "run_0.mcap", rows)


def scanned(file: Path, data: bytes) -> tuple[list[Row], Scan]:
    file.write_bytes(data)
    scan = Scan(file)
    return [(m.channel.topic, m.data, m.log_time_ns) for m in scan], scan


def flipped(data: bytes, places: list[tuple[int, int]]) -> bytes:
    changed = bytearray(data)
    for place, bit in places:
        changed[place] ^= 1 << bit
    return bytes(changed)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    cut=st.none() | st.floats(0.0, 1.0),
    flips=st.lists(st.tuples(st.floats(0.0, 0.9999), st.integers(0, 7)), max_size=3),
    blank=st.none() | st.tuples(st.floats(0.0, 0.95), st.integers(1, 1200)),
)
@example(cut=None, flips=[(0.0, 3)], blank=None)  # the first byte of all
@example(cut=None, flips=[], blank=(0.3, 1200))
@example(cut=0.7, flips=[(0.06, 1)], blank=None)  # the first chunk, which introduces the topics
def test_every_whole_chunk_is_kept(
    tmp_path: Path,
    sample: Sample,
    cut: float | None,
    flips: list[tuple[float, int]],
    blank: tuple[float, int] | None,
) -> None:
    for name in ("broken", "out"):
        shutil.rmtree(tmp_path / name, ignore_errors=True)
    (tmp_path / "broken").mkdir()
    file = tmp_path / "broken" / "broken_0.mcap"
    length = len(sample.data)
    size = length if cut is None else round(cut * length)
    places = [(int(where * length), bit) for where, bit in flips]
    data = bytearray(flipped(sample.data, places))
    damaged = {place for place, _ in places}
    if blank is not None:  # as a file system leaves blocks that it never wrote
        begin = int(blank[0] * length)
        end = min(begin + blank[1], length)
        damaged |= {place for place in range(begin, end) if data[place]}
        data[begin:end] = bytes(end - begin)
    # Topics are introduced twice, before the first chunk and in it, and once more in the index.
    first, first_end, _ = sample.chunks[0]
    twice = any(p < first for p in damaged) and any(first <= p < first_end for p in damaged)
    assume(not twice)
    content = bytes(data[:size])
    file.write_bytes(content)
    kept = sample.whole(damaged, size)
    try:
        report = salvage(tmp_path / "broken", tmp_path / "out")
    except DataError:
        assert not kept
        assert not (tmp_path / "out").exists()
        return
    finally:
        assert file.read_bytes() == content
        assert [path.name for path in file.parent.iterdir()] == [file.name]
    found = [(m.topic, m.data, m.log_time_ns) for m in BagReader(tmp_path / "out").messages()]
    assert kept <= set(found)
    assert len(set(found)) == len(found) == report.metadata.message_count
    if not report.partial_messages:
        assert set(found) <= set(sample.rows)
    with (tmp_path / "out" / "out_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert [(c.topic, m.data, m.log_time) for _, c, m in reader.iter_messages()] == found
    if found:
        with AnyReader([tmp_path / "out"]) as bag:
            assert bag.message_count == len(found)
            assert [(c.topic, bytes(r), t) for c, t, r in bag.messages()] == found


def test_any_byte_between_two_chunks_may_be_wrong(tmp_path: Path, sample: Sample) -> None:
    """Heads of records, lengths, indexes: a flip of any bit of them costs one chunk at most."""
    begin, end, _ = sample.chunks[3]
    following = sample.chunks[4][0]
    places = [(place, place % 8) for place in [*range(40), *range(end, following)]]
    places += [(place, bit) for place in range(begin, begin + 60) for bit in range(8)]
    for place, bit in places:
        found, scan = scanned(tmp_path / "x.mcap", flipped(sample.data, [(place, bit)]))
        assert set(found) >= sample.whole({place}, len(sample.data)), (place, bit)
        assert set(found) <= set(sample.rows), (place, bit)
        assert len(found) == len(set(found)), (place, bit)
        assert scan.result.closed, (place, bit)


@pytest.mark.parametrize("where", ["head", "chunk", "index", "summary"])
def test_a_cut_at_every_byte(tmp_path: Path, sample: Sample, where: str) -> None:
    begin, end, _ = sample.chunks[3]
    places = {
        "head": range(8, 200),
        "chunk": range(begin, end, 3),
        "index": range(end, sample.chunks[4][0]),
        "summary": range(len(sample.data) - 300, len(sample.data)),
    }[where]
    for size in places:
        found, scan = scanned(tmp_path / "x.mcap", sample.data[:size])
        assert tuple(found) == sample.rows[: len(found)]
        assert set(found) >= sample.whole(set(), size)
        assert not scan.result.closed
        assert (scan.result.broken, scan.result.damaged_chunks) == (0, 0)
        assert scan.result.read <= size


def test_what_was_passed_over_is_said(tmp_path: Path, sample: Sample) -> None:
    begin, _, rows = sample.chunks[5]
    length = begin + 1
    found, scan = scanned(tmp_path / "x.mcap", flipped(sample.data, [(length + 3, 2)]))
    # Only the length of its record is wrong: the chunk is found by its own.
    assert set(found) == set(sample.rows)
    assert (scan.result.broken, scan.result.damaged_chunks) == (1, 0)
    found, scan = scanned(tmp_path / "x.mcap", flipped(sample.data, [(begin + 80, 2)]))
    assert set(sample.rows) - set(found) == set(rows)
    assert (scan.result.broken, scan.result.damaged_chunks) == (0, 1)
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut" / "cut_0.mcap").write_bytes(
        flipped(sample.data, [(begin + 80, 2), (sample.chunks[7][0] + 80, 2)])[:-50]
    )
    warnings = " ".join(inspect_bag(tmp_path / "cut").warnings)
    assert "the messages of 2 of its chunks are lost" in warnings
    assert salvage(tmp_path / "cut", tmp_path / "out").damaged_chunks == 2


def write_foreign(file: Path, rows: list[Row], **options: object) -> None:
    """A file as another program writes it: topics in the first chunk alone."""
    with file.open("wb") as stream:
        writer = Writer(stream, chunk_size=1500, **options)
        writer.start(profile="ros2", library="another")
        schema = writer.register_schema("std_msgs/msg/UInt64", "ros2msg", b"uint64 data")
        topics = sorted({row[0] for row in rows})
        channels = {topic: writer.register_channel(topic, "cdr", schema) for topic in topics}
        for topic, data, time in rows:
            writer.add_message(channels[topic], time, data, time)
        writer.finish()


@pytest.mark.parametrize("compression", list(CompressionType))
def test_files_of_other_programs(tmp_path: Path, compression: CompressionType) -> None:
    rows = some_rows(300)
    write_foreign(tmp_path / "a.mcap", rows, compression=compression)
    foreign = read_sample(tmp_path / "a.mcap", rows)
    assert len(foreign.chunks) > 4
    size = len(foreign.data)
    assert scanned(tmp_path / "x.mcap", foreign.data)[0] == rows
    for number, (begin, end, _) in enumerate(foreign.chunks[:4]):
        # The head of the record, its contents, and the first of the indexes behind it.
        for place in (*range(begin + 1, begin + 70, 2), end + 3):
            found, _ = scanned(tmp_path / "x.mcap", flipped(foreign.data, [(place, 4)]))
            assert set(found) >= foreign.whole({place}, size), (number, place)
            assert set(found) <= set(rows)


def test_a_file_without_chunks(tmp_path: Path) -> None:
    rows = some_rows(30)
    write_foreign(tmp_path / "a.mcap", rows, use_chunking=False)
    data = (tmp_path / "a.mcap").read_bytes()
    assert scanned(tmp_path / "x.mcap", data)[0] == rows
    found, _ = scanned(tmp_path / "x.mcap", data[: len(data) // 2])
    assert found == rows[: len(found)]
    assert 0 < len(found) < 30


def test_a_frame_that_claims_to_be_huge_is_damage(tmp_path: Path, sample: Sample) -> None:
    begin, end, rows = sample.chunks[2]
    frame = sample.data.index(b"\x28\xb5\x2f\xfd", begin, end)
    assert sample.data[frame + 4] >> 6 == 1  # the size of the content has two bytes
    claim = bytes([sample.data[frame + 4] | 0xC0]) + b"\xff" * 7 + b"\x00"
    changed = sample.data[: frame + 4] + claim + sample.data[frame + 4 + len(claim) :]
    found, scan = scanned(tmp_path / "x.mcap", changed)
    assert set(sample.rows) - set(found) == set(rows)
    assert scan.result.damaged_chunks == 1


@pytest.fixture
def bag(tmp_path: Path, write_bag: Callable[..., object]) -> Path:
    write_bag(tmp_path / "run", count=50, chunk_bytes=2048)
    return tmp_path / "run"


def test_half_a_metadata_file(bag: Path, tmp_path: Path) -> None:
    text = (bag / "metadata.yaml").read_text()
    for number, size in enumerate((0, 5, len(text) // 3, len(text) // 2, len(text) - 200)):
        (bag / "metadata.yaml").write_text(text[:size])
        with pytest.raises(DataError, match=r"metadata\.yaml.*--salvage"):
            inspect_bag(bag)
        salvage(bag, tmp_path / f"out_{number}")
        reader = BagReader(tmp_path / f"out_{number}")
        assert reader.metadata.message_count == 50
        assert reader.custom_data["seed"] == "7"
        with AnyReader([reader.path]) as another:
            assert another.message_count == 50


def test_no_metadata_file(bag: Path, tmp_path: Path) -> None:
    (bag / "metadata.yaml").unlink()
    assert inspect_bag(bag).messages == 50
    salvage(bag, tmp_path / "out")
    assert inspect_bag(tmp_path / "out").custom_data["seed"] == "7"
