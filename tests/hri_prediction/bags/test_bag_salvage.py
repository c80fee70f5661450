from __future__ import annotations

import contextlib
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader

from hri_prediction.bags import BagReader, inspect_bag, salvage
from hri_prediction.errors import ConfigError, DataError


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[bytes, list[tuple[str, bytes, int]]]:
    """Bytes of a whole file and the messages in it."""
    from hri_prediction.bags import BagWriter, TopicInfo

    folder = tmp_path_factory.mktemp("whole") / "run"
    rows = []
    with BagWriter(folder, chunk_bytes=1500) as writer:
        channels = [writer.add_topic(TopicInfo(f"/t{i}", "std_msgs/msg/UInt64")) for i in range(3)]
        for index in range(400):
            data = b"\x00\x01\x00\x00" + (index * 7919).to_bytes(8, "little")
            writer.write(channels[index % 3], data, 1000 + index)
            rows.append((f"/t{index % 3}", data, 1000 + index))
    return (folder / "run_0.mcap").read_bytes(), rows


def scratch(tmp_path: Path) -> tuple[Path, Path]:
    for name in ("cut", "out"):
        shutil.rmtree(tmp_path / name, ignore_errors=True)
    (tmp_path / "cut").mkdir()
    return tmp_path / "cut" / "cut_0.mcap", tmp_path / "out"


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(where=st.floats(0.0, 1.0))
@example(where=1.0)
@example(where=0.0)
def test_a_file_cut_anywhere_gives_a_prefix_back(tmp_path: Path, whole, where: float) -> None:
    data, rows = whole
    file, out = scratch(tmp_path)
    size = round(where * len(data))
    file.write_bytes(data[:size])
    if size < 8:
        with pytest.raises(DataError, match=r"no MCAP"):
            salvage(file.parent, out)
        assert not out.exists()
        return
    report = salvage(file.parent, out)
    found = [(m.topic, m.data, m.log_time_ns) for m in BagReader(out).messages()]
    assert found == rows[: len(found)]
    assert report.metadata.message_count == len(found)
    if size == len(data):
        assert found == rows
    assert report.damaged_chunks == 0
    if found:
        with AnyReader([out]) as reader:
            assert [(c.topic, bytes(r), t) for c, t, r in reader.messages()] == found


def test_every_chunk_that_was_complete_comes_back(tmp_path: Path, whole) -> None:
    """The loss of a cut is less than one chunk, and a cut chunk gives what it can."""
    from mcap.reader import make_reader

    data, rows = whole
    file, out = scratch(tmp_path)
    file.write_bytes(data)
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    for number, chunk in enumerate(summary.chunk_indexes[:4]):
        shutil.rmtree(out, ignore_errors=True)
        file.write_bytes(data[: chunk.chunk_start_offset + chunk.chunk_length])
        report = salvage(file, out)
        assert report.files["cut_0.mcap"].chunks == number + 1
        last = chunk.message_end_time
        assert report.metadata.message_count == sum(row[2] <= last for row in rows)


def test_a_cut_chunk_gives_what_it_holds(tmp_path: Path) -> None:
    from hri_prediction.bags import BagWriter, TopicInfo

    file, out = scratch(tmp_path)
    rng = __import__("random").Random(4)
    with BagWriter(tmp_path / "big", chunk_bytes=1 << 20) as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
        for index in range(8000):
            writer.write(channel, rng.randbytes(100), index)
    data = (tmp_path / "big" / "big_0.mcap").read_bytes()
    file.write_bytes(data[: len(data) // 2])
    report = salvage(file, out)
    assert report.files["cut_0.mcap"].chunks == 0
    assert report.partial_messages == report.metadata.message_count > 2000
    found = report.files["cut_0.mcap"]
    assert found.cut_until_ns == 7999
    assert found.last_ns == report.partial_messages - 1
    assert found.cut_bytes > 100 * (8000 - report.partial_messages)
    said = " | ".join(report.missing)
    assert f"{report.partial_messages} messages of it were read" in said
    assert f"{found.cut_bytes:,} bytes of messages up to" in said
    assert f"of {found.size:,}; the {found.size - found.read:,} behind that are no whole" in said
    assert BagReader(out).custom_data["not_salvaged"] == "; ".join(report.missing)
    # Salvaged once more, it still says so.
    assert salvage(out, tmp_path / "again").missing == ()
    again = BagReader(tmp_path / "again").custom_data
    assert again["not_salvaged"] == "; ".join(report.missing)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(damage=st.lists(st.tuples(st.floats(0.01, 0.999), st.integers(1, 255)), max_size=3))
def test_damage_never_invents_messages(tmp_path: Path, whole, damage) -> None:
    data, rows = whole
    file, out = scratch(tmp_path)
    changed = bytearray(data)
    for where, flip in damage:
        changed[int(where * len(data))] ^= flip
    file.write_bytes(bytes(changed))
    salvage(file, out)
    known = {(row[1], row[2]) for row in rows}
    assert all((m.data, m.log_time_ns) in known for m in BagReader(out).messages())
    # A reader that trusts the index either finds nothing wrong or says what is.
    with contextlib.suppress(DataError):
        inspect_bag(file)
        list(BagReader(file).messages())


def test_a_damaged_chunk_is_passed_over(tmp_path: Path, whole) -> None:
    data, rows = whole
    file, out = scratch(tmp_path)
    chunk = data.index(b"\x28\xb5\x2f\xfd", len(data) // 3)  # magic of a zstd frame
    file.write_bytes(data[: chunk + 20] + b"\xff\xff\xff" + data[chunk + 23 :])
    report = salvage(file, out)
    assert report.damaged_chunks == 1
    assert 0 < len(rows) - report.metadata.message_count < 80
    with pytest.raises(DataError, match=r"damaged.*salvage"):
        list(BagReader(file).messages())


def test_provenance_survives(tmp_path: Path, write_bag) -> None:
    write_bag(tmp_path / "run", chunk_bytes=2048)
    file = tmp_path / "run" / "run_0.mcap"
    file.write_bytes(file.read_bytes()[:-200])
    assert not inspect_bag(tmp_path / "run").closed
    with pytest.raises(DataError, match=r"not closed.*--salvage"):
        BagReader(tmp_path / "run")
    salvage(tmp_path / "run", tmp_path / "out")
    reader = BagReader(tmp_path / "out")
    missing = reader.custom_data["not_salvaged"]
    assert missing.startswith("run_0.mcap was not closed: ")
    assert reader.custom_data == {"seed": "7", "salvaged_from": "run", "not_salvaged": missing}
    assert [(a.name, a.data) for a in reader.attachments()] == [("notes.txt", b"hello")]
    assert reader.topics["/words"].type_hash.startswith("RIHS01_df668c74")
    assert reader.topics["/numbers"].qos[0].reliability == "best_effort"


def test_nothing_is_overwritten(tmp_path: Path, write_bag) -> None:
    write_bag(tmp_path / "run", count=5)
    with pytest.raises(ConfigError, match=r"exists already"):
        salvage(tmp_path / "run", tmp_path / "run")


WRITER = """
import sys, time
from hri_prediction.bags.metadata import TopicInfo
from hri_sim.recording.recorder_core import RecorderConfig, RecorderCore
core = RecorderCore(sys.argv[1], RecorderConfig(flush_period=0.2), custom_data={"seed": "9"})
topic = core.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
number = 0
start = time.monotonic()
while True:
    while number < (time.monotonic() - start) * 2000:
        number += 1
        core.push(topic, number.to_bytes(8, "little"), time.time_ns(), time.time_ns(), number)
    print(number, time.time_ns(), flush=True)
    time.sleep(0.01)
"""


def test_kill_9_loses_less_than_a_second(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with log.open("w") as stream:
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path / "run")], stdout=stream
        )
    try:
        end = time.monotonic() + 20.0
        while log.stat().st_size == 0 and time.monotonic() < end:
            time.sleep(0.02)
        time.sleep(1.5)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    text = log.read_text()
    text = text[: text.rindex("\n")]
    last, killed_ns = (int(word) for word in text.splitlines()[-1].split())

    report = inspect_bag(tmp_path / "run")
    assert not report.closed
    assert any("not closed" in warning for warning in report.warnings)
    salvaged = salvage(tmp_path / "run", tmp_path / "out")
    messages = list(BagReader(tmp_path / "out").messages())
    assert [m.sequence for m in messages] == list(range(1, len(messages) + 1))
    assert len(messages) > 1000
    assert (killed_ns - messages[-1].log_time_ns) * 1e-9 < 0.9
    assert last - len(messages) < 2000
    assert salvaged.metadata.custom_data["seed"] == "9"
    assert json.dumps(inspect_bag(tmp_path / "out").to_mapping())
    assert inspect_bag(tmp_path / "out").closed
