"""Bags are read back by this package and by two independent libraries."""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, inspect_bag
from hri_prediction.bags.metadata import read_metadata
from hri_prediction.errors import ConfigError, DataError


def rows_of(bag: Path) -> list:
    return [
        (m.topic, m.data, m.log_time_ns, m.publish_time_ns, m.sequence)
        for m in BagReader(bag).messages()
    ]


def test_own_reader_gives_every_message_back(tmp_path: Path, write_bag) -> None:
    rows = write_bag(tmp_path / "run", chunk_bytes=2048)
    assert rows_of(tmp_path / "run") == rows
    assert rows_of(tmp_path / "run" / "run_0.mcap") == rows
    reader = BagReader(tmp_path / "run")
    assert reader.custom_data == {"seed": "7"}
    assert [(a.name, a.data) for a in reader.attachments()] == [("notes.txt", b"hello")]
    assert reader.topics["/words"].type_hash.startswith("RIHS01_df668c74")
    assert reader.topics["/numbers"].qos[0].reliability == "best_effort"
    assert reader.topics["/silent"].message_count == 0


def test_rosbags_gives_every_message_back(tmp_path: Path, write_bag) -> None:
    rows = write_bag(tmp_path / "run", chunk_bytes=2048)
    with AnyReader([tmp_path / "run"]) as reader:
        found = [(c.topic, bytes(raw), t) for c, t, raw in reader.messages()]
        assert found == [row[:3] for row in rows]
        words = [
            reader.deserialize(raw, c.msgtype).data
            for c, _, raw in reader.messages()
            if c.topic == "/words"
        ]
        assert words == [f"word {i}" for i in range(0, len(rows), 3)]
        assert reader.topics["/silent"].msgcount == 0


def test_mcap_ros2_gives_every_message_back(tmp_path: Path, write_bag) -> None:
    rows = write_bag(tmp_path / "run", chunk_bytes=2048)
    with (tmp_path / "run" / "run_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages())
        assert [
            (
                f.channel.topic,
                f.message.data,
                f.message.log_time,
                f.message.publish_time,
                f.message.sequence,
            )
            for f in found
        ] == rows
        assert [f.decoded_message.data for f in found if f.channel.topic == "/numbers"] == [
            i for i in range(len(rows)) if i % 3
        ]


def test_mcap_records_are_as_rosbag2_writes_them(tmp_path: Path, write_bag) -> None:
    rows = write_bag(tmp_path / "run", chunk_bytes=2048)
    with (tmp_path / "run" / "run_0.mcap").open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(rows)
        assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 5
        assert all(chunk.compression == "zstd" for chunk in summary.chunk_indexes)
        assert all(chunk.message_index_offsets for chunk in summary.chunk_indexes)
        channels = {channel.topic: channel for channel in summary.channels.values()}
        assert set(channels["/words"].metadata) == {"offered_qos_profiles", "topic_type_hash"}
        profiles = yaml.safe_load(channels["/numbers"].metadata["offered_qos_profiles"])
        assert profiles[0]["reliability"] == "best_effort"
        (record,) = reader.iter_metadata()
        assert record.name == "rosbag2"
        stored = yaml.safe_load(record.metadata["serialized_metadata"])
    on_disk = yaml.safe_load((tmp_path / "run" / "metadata.yaml").read_text())
    assert stored == on_disk["rosbag2_bagfile_information"]
    assert stored["message_count"] == len(rows)
    with (tmp_path / "run" / "run_0.mcap").open("rb") as stream:
        for _ in StreamReader(stream, validate_crcs=True).records:  # raises on a wrong checksum
            pass


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    messages=st.lists(
        st.tuples(
            st.integers(0, 3),
            st.binary(max_size=300),
            st.integers(0, 2**63 - 1),
            st.integers(0, 2**63 - 1),
            st.integers(0, 2**32 - 1),
        ),
        max_size=60,
    ),
    chunk=st.sampled_from([64, 1000, 1 << 20]),
)
def test_any_messages_survive_in_any_order(tmp_path: Path, messages, chunk: int) -> None:
    folder = tmp_path / "any"
    shutil.rmtree(folder, ignore_errors=True)
    with BagWriter(folder, chunk_bytes=chunk) as writer:
        channels = [writer.add_topic(TopicInfo(f"/t{i}", "std_msgs/msg/String")) for i in range(4)]
        for channel, data, log, publish, sequence in messages:
            writer.write(channels[channel], data, log, publish, sequence)
    expected = sorted((f"/t{c}", d, log, p, s) for c, d, log, p, s in messages)
    found = rows_of(folder)
    assert sorted(found) == expected
    assert [row[2] for row in found] == sorted(row[2] for row in found)
    if messages:
        with AnyReader([folder]) as reader:
            assert sorted((c.topic, bytes(r), t) for c, t, r in reader.messages()) == sorted(
                row[:3] for row in expected
            )


def test_topics_and_times_select(tmp_path: Path, write_bag) -> None:
    rows = write_bag(tmp_path / "run", chunk_bytes=2048)
    begin, end = rows[100][2], rows[200][2]
    found = list(BagReader(tmp_path / "run").messages(["/words"], begin, end))
    assert [m.log_time_ns for m in found] == [
        row[2] for row in rows if row[0] == "/words" and begin <= row[2] < end
    ]


def test_a_bag_of_several_files_is_read_in_order(tmp_path: Path, write_bag) -> None:
    first = write_bag(tmp_path / "a", count=100)
    write_bag(tmp_path / "b", count=100)
    both = tmp_path / "both"
    both.mkdir()
    for name in "ab":
        shutil.copy(tmp_path / name / f"{name}_0.mcap", both)
    found = [m.log_time_ns for m in BagReader(both).messages()]
    assert found == sorted([row[2] for row in first] * 2)
    assert BagReader(both).metadata.message_count == 200


def test_a_written_message_is_in_the_file_after_a_flush(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run", flush_period=0.0)
    channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/String"))
    writer.write(channel, b"x", 1)
    assert writer.message_count == 0
    writer.flush_if_due()
    assert writer.message_count == 1
    assert [m.data for m in BagReader(writer.folder, allow_unclosed=True).messages()] == [b"x"]
    writer.close()


def test_a_folder_that_exists_is_refused(tmp_path: Path, write_bag) -> None:
    write_bag(tmp_path / "run", count=1)
    before = (tmp_path / "run" / "metadata.yaml").read_bytes()
    with pytest.raises(ConfigError, match=r"exists already"):
        BagWriter(tmp_path / "run")
    assert (tmp_path / "run" / "metadata.yaml").read_bytes() == before


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot make the bag folder"):
        BagWriter(tmp_path / "file" / "run")
    with pytest.raises(ConfigError, match=r"cannot make the bag folder"):
        BagWriter("/proc/run")


def test_too_little_space_is_refused_at_once(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"MB left.*free some disk space"):
        BagWriter(tmp_path / "run", min_free_bytes=10**18)


FULL = """
import resource, signal, json, sys
from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.errors import DataError
import random
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
rng = random.Random(1)
writer = BagWriter(sys.argv[1], chunk_bytes=20_000)
channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
resource.setrlimit(resource.RLIMIT_FSIZE, (MOST, MOST))
count, text = 0, ""
try:
    for count in range(100_000):
        writer.write(channel, rng.randbytes(100), count)
except DataError as error:
    text = str(error)
held = writer.message_count
for _ in range(3):
    try:
        writer.flush()
    except DataError:
        pass
closing = ""
try:
    writer.close()
except DataError as error:
    closing = str(error)
print(json.dumps([count, held, writer.lost_messages, text, closing]))
"""


@pytest.mark.parametrize("limit", [150_000, 101_000, 65_000])
def test_a_full_disk_leaves_what_is_recorded_readable(tmp_path: Path, limit: int) -> None:
    script = textwrap.dedent(FULL).replace("MOST", str(limit))
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "run")],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    last, held, lost, text, closing = json.loads(done.stdout)
    assert "cannot write to" in text
    assert "free some disk space" in text
    assert held > 100
    report = inspect_bag(tmp_path / "run")
    assert report.closed == (not closing)
    assert report.messages == held
    assert held + lost == last + 1
    if report.closed:
        with AnyReader([tmp_path / "run"]) as reader:
            assert [t for _, t, _ in reader.messages()] == list(range(held))


def test_space_that_comes_back_loses_nothing(tmp_path: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    writer = BagWriter(tmp_path / "run", chunk_bytes=1 << 20)
    channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
    for index in range(5000):
        writer.write(channel, index.to_bytes(8, "little") * 10, index)
    resource.setrlimit(resource.RLIMIT_FSIZE, (writer.size + 500, limits[1]))
    try:
        with pytest.raises(DataError, match=r"cannot write"):
            writer.flush()
        writer.write(channel, b"after", 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    writer.flush()
    assert writer.close().message_count == 5001
    assert len(rows_of(tmp_path / "run")) == 5001


def test_metadata_is_there_from_the_start(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "run", custom_data={"seed": "3"})
    first = read_metadata(tmp_path / "run")
    assert first.message_count == 0
    assert first.custom_data == {"seed": "3"}
    assert writer.close() == writer.close()


@pytest.mark.parametrize("name", ["missing", "empty", "text.mcap"])
def test_what_is_no_bag_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("this is not a bag, but long enough to hold a magic")
    with pytest.raises(DataError):
        list(BagReader(tmp_path / name).messages())
    with pytest.raises(DataError):
        list(BagReader(tmp_path / name, allow_unclosed=True).messages())
