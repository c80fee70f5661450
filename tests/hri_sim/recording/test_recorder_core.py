from __future__ import annotations

import errno
import os
import resource
import shutil
import time
from pathlib import Path

import pytest

from hri_prediction.bags import BagReader, TopicInfo, durable, inspect_bag
from hri_prediction.errors import ConfigError, DataError
from hri_sim.recording.condition import BEHIND_S, troubles
from hri_sim.recording.provenance import collect_provenance, custom_data, parse_provenance
from hri_sim.recording.recorder_core import RecorderConfig, RecorderCore


def wait_for(core: RecorderCore, written: int) -> bool:
    """Wait until the operating system has so many messages; False after 5 s."""
    end = time.monotonic() + 5.0
    while core.state.written < written and time.monotonic() < end:
        time.sleep(0.01)
    return core.state.written >= written


INFO = TopicInfo("/a", "std_msgs/msg/UInt64")


def push(core: RecorderCore, topic: int, count: int, size: int = 8) -> None:
    for index in range(count):
        data = index.to_bytes(8, "little") + bytes(size - 8)
        core.push(topic, data, index + 1, index, index + 1)


def test_everything_pushed_is_in_the_bag(tmp_path: Path) -> None:
    core = RecorderCore(tmp_path / "run", custom_data={"seed": "1"})
    topic = core.add_topic(INFO)
    push(core, topic, 20_000)
    late = core.add_topic(TopicInfo("/late", "std_msgs/msg/String"))
    core.push(late, b"x", 30_000, 30_000)
    assert core.close().message_count == 20_001
    assert core.close().message_count == 20_001
    messages = list(BagReader(tmp_path / "run").messages(["/a"]))
    assert [m.sequence for m in messages] == list(range(1, 20_001))
    assert core.state.dropped == core.state.lost == core.state.queued == 0
    assert core.state.queued_bytes == 0


def test_messages_reach_the_disk_within_the_flush_period(tmp_path: Path) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(flush_period=0.2))
    topic = core.add_topic(INFO)
    start = time.monotonic()
    push(core, topic, 10)
    assert wait_for(core, 10)
    assert time.monotonic() - start < 0.6
    report = inspect_bag(tmp_path / "run")
    assert (report.messages, report.closed) == (10, False)
    core.close()
    assert inspect_bag(tmp_path / "run").closed


def test_a_topic_without_messages_is_listed(tmp_path: Path) -> None:
    core = RecorderCore(tmp_path / "run")
    core.add_topic(INFO)
    (topic,) = core.close().topics
    assert (topic.name, topic.message_count) == ("/a", 0)


def test_a_full_queue_drops_and_counts(tmp_path: Path) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(queue_megabytes=1))
    topic = core.add_topic(INFO)
    core.push(topic, bytes(900_000), 1, 1)
    accepted = core.push(topic, bytes(900_000), 2, 2)
    assert not accepted
    assert core.state.dropped == 1
    assert core.dropped_by_topic == {"/a": 1}
    assert core.close().message_count == 1


@pytest.fixture
def disk_limit():
    """Limits the size of files, as a full disk would; the limit is taken back afterwards."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(
        resource.RLIMIT_FSIZE, (before[0] if size is None else size, before[1])
    )
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_full_disk_ends_by_policy(tmp_path: Path, disk_limit) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(flush_period=0.1, chunk_kilobytes=16))
    topic = core.add_topic(INFO)
    push(core, topic, 100)
    assert wait_for(core, 100)
    disk_limit(core.state.file_bytes + 5000)
    rng = __import__("random").Random(2)
    for index in range(500):
        core.push(topic, rng.randbytes(100), 200 + index, 200 + index)
    end = time.monotonic() + 5.0
    while not core.must_end and time.monotonic() < end:
        time.sleep(0.01)
    assert core.must_end
    assert "cannot write" in core.state.error
    metadata = core.close()
    state = core.state
    assert 100 <= metadata.message_count < 600
    assert metadata.message_count + state.lost == 600
    disk_limit(None)
    assert inspect_bag(tmp_path / "run").messages == metadata.message_count


def test_a_recorder_that_stays_goes_on_when_there_is_space(tmp_path: Path, disk_limit) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(flush_period=0.1, on_error="stay"))
    topic = core.add_topic(INFO)
    push(core, topic, 100)
    assert wait_for(core, 100)
    disk_limit(core.state.file_bytes + 10)
    push(core, topic, 100)
    end = time.monotonic() + 5.0
    while not core.state.error and time.monotonic() < end:
        time.sleep(0.01)
    assert core.state.error
    assert not core.must_end
    push(core, topic, 100)
    disk_limit(None)
    assert wait_for(core, 300)
    assert core.state.error == ""
    assert core.close().message_count == 300


def test_bad_places_are_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "something").write_text("")
    with pytest.raises(ConfigError, match=r"exists already"):
        RecorderCore(tmp_path / "run")
    with pytest.raises(ConfigError, match=r"cannot make"):
        RecorderCore("/proc/nothing")
    with pytest.raises(DataError, match=r"MB left"):
        RecorderCore(tmp_path / "new", RecorderConfig(min_free_megabytes=10**9))
    with pytest.raises(ConfigError, match=r"flush_period"):
        RecorderConfig(flush_period=2.0)


def test_provenance(tmp_path: Path) -> None:
    assert parse_provenance("") == {}
    assert parse_provenance('{"seed": 3}') == {"seed": 3}
    (tmp_path / "run.json").write_text('{"models": ["a", "b"]}')
    run = parse_provenance(str(tmp_path / "run.json"))
    strings = custom_data(collect_provenance(run))
    assert strings["models"] == '["a", "b"]'
    assert strings["python"]
    assert all(isinstance(value, str) for value in strings.values())
    for text in ("[1]", "{", "/no/such/file"):
        with pytest.raises(ConfigError):
            parse_provenance(text)


def test_a_slow_disk_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(flush_period=0.05, sync_period=0.05))
    topic = core.add_topic(INFO)
    assert core.state.behind_s < 0.5
    monkeypatch.setattr(durable, "sync", lambda descriptor: time.sleep(1.5))
    push(core, topic, 10)
    end = time.monotonic() + 5.0
    while core.state.behind_s <= BEHIND_S and time.monotonic() < end:
        core.push(topic, bytes(8), 1, 1)
        time.sleep(0.01)
    (trouble,) = troubles(core.state, core.dropped_by_topic, {}, {})
    assert trouble.kind == "behind"
    assert core.state.queued > 10
    monkeypatch.undo()
    core.close()
    assert core.state.behind_s == 0.0
    assert core.missing_by_topic == {}


@pytest.mark.parametrize("policy", ["end", "stay"])
def test_a_disk_that_fails_is_not_forgotten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, policy: str
) -> None:
    def fail(descriptor: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    config = RecorderConfig(flush_period=0.05, sync_period=0.05, on_error=policy)
    core = RecorderCore(tmp_path / "run", config)
    topic = core.add_topic(INFO)
    with monkeypatch.context() as patch:
        patch.setattr(durable, "sync", fail)
        push(core, topic, 10)
        end = time.monotonic() + 5.0
        while not core.state.error and time.monotonic() < end:
            time.sleep(0.001)
        assert "did not take what was written" in core.state.error
        assert core.must_end is (policy == "end")
    if policy == "stay":
        push(core, topic, 10)
        assert wait_for(core, 20)
    with pytest.raises(DataError, match=r"Input/output error"):
        core.close()
    assert inspect_bag(tmp_path / "run").messages == core.state.written


def test_a_disk_that_comes_back_is_written_to_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(path: Path) -> None:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))

    core = RecorderCore(tmp_path / "run", RecorderConfig(flush_period=0.05, on_error="stay"))
    topic = core.add_topic(INFO)
    with monkeypatch.context() as patch:
        patch.setattr(shutil, "disk_usage", gone)
        push(core, topic, 10)
        end = time.monotonic() + 5.0
        while not core.state.error and time.monotonic() < end:
            time.sleep(0.001)
        assert "does not answer: No such file" in core.state.error
        time.sleep(0.2)  # it is tried again, and goes wrong again
    push(core, topic, 10)
    assert wait_for(core, 20)
    core.close()
    assert inspect_bag(tmp_path / "run").messages == 20


def test_the_queue_tells_how_full_it_is(tmp_path: Path) -> None:
    core = RecorderCore(tmp_path / "run", RecorderConfig(queue_megabytes=1))
    topic = core.add_topic(INFO)
    core.push(topic, bytes(700_000), 1, 1)
    assert core.state.queue_share == pytest.approx(0.7)
    core.push(topic, bytes(700_000), 2, 2)
    assert core.close().message_count == 1
    assert core.missing_by_topic == {"/a": 1}
    assert core.state.queue_share == 0.0
