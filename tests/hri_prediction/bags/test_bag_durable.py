"""What is on the disk when: files that are replaced in one step, synced, and closed in order."""

from __future__ import annotations

import errno
import os
import threading
import time
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from hri_prediction.bags import (
    BagReader,
    BagWriter,
    TopicInfo,
    durable,
    inspect_bag,
    salvage,
    writer,
)
from hri_prediction.bags.mcap_file import McapFile
from hri_prediction.bags.metadata import BagMetadata, read_metadata, write_metadata
from hri_prediction.bags.reader import is_closed
from hri_prediction.errors import DataError

INFO = TopicInfo("/a", "std_msgs/msg/UInt64")
CDR = b"\x00\x01\x00\x00" + bytes(8)
GONE = OSError(errno.EIO, os.strerror(errno.EIO))


@pytest.fixture
def synced(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was synced or put in place, in order."""
    done: list[str] = []
    sync, replace = durable.sync, Path.replace

    def note(descriptor: int) -> None:
        done.append(f"sync {Path(os.readlink(f'/proc/self/fd/{descriptor}')).name}")
        sync(descriptor)

    def put(self: Path, target: Path) -> Path:
        done.append(f"replace {target.name}")
        return replace(self, target)

    monkeypatch.setattr(durable, "sync", note)
    monkeypatch.setattr(Path, "replace", put)
    return done


def filled(folder: Path, count: int = 10, **options: float) -> BagWriter:
    made = BagWriter(folder, custom_data={"seed": "7"}, **options)
    channel = made.add_topic(INFO)
    for index in range(count):
        made.write(channel, CDR, 1000 + index)
    return made


def test_metadata_is_on_the_disk_before_it_counts(tmp_path: Path, synced: list[str]) -> None:
    write_metadata(tmp_path, BagMetadata())
    draft, *rest = synced
    assert draft.startswith("sync .metadata.yaml.")
    assert rest == ["replace metadata.yaml", f"sync {tmp_path.name}"]


def test_a_bag_is_on_the_disk_when_it_is_closed(tmp_path: Path, synced: list[str]) -> None:
    made = filled(tmp_path / "run")
    synced.clear()
    made.close()
    assert synced[-1] == "sync run_0.mcap"
    assert synced[1:-1] == ["replace metadata.yaml", "sync run"]


def test_a_reader_never_sees_half_a_metadata_file(tmp_path: Path) -> None:
    texts = [BagMetadata(message_count=n, custom_data={"a": "x" * n}) for n in (1, 50_000)]
    write_metadata(tmp_path, texts[0])
    stop = threading.Event()

    def replace() -> None:
        while not stop.is_set():
            for metadata in texts:
                write_metadata(tmp_path, metadata)

    thread = threading.Thread(target=replace)
    thread.start()
    try:
        seen = {read_metadata(tmp_path).message_count for _ in range(40)}
    finally:
        stop.set()
        thread.join()
    assert seen <= {1, 50_000}


def test_metadata_that_cannot_be_replaced_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_metadata(tmp_path, BagMetadata(message_count=3))

    def fail(descriptor: int) -> None:
        raise GONE

    monkeypatch.setattr(durable, "sync", fail)
    with pytest.raises(DataError, match=r"cannot write .*metadata\.yaml"):
        write_metadata(tmp_path, BagMetadata(message_count=4))
    assert read_metadata(tmp_path).message_count == 3
    assert [path.name for path in tmp_path.iterdir()] == ["metadata.yaml"]


def test_an_open_bag_can_be_read(tmp_path: Path) -> None:
    made = filled(tmp_path / "run")
    assert read_metadata(tmp_path / "run").custom_data == {"seed": "7"}
    made.flush()
    reader = BagReader(tmp_path / "run", allow_unclosed=True)
    assert reader.metadata.message_count == 10
    assert reader.custom_data == {"seed": "7"}
    made.close()


def test_the_disk_is_given_its_share_in_time(tmp_path: Path, synced: list[str]) -> None:
    made = filled(tmp_path / "run", flush_period=0.05, sync_period=0.2)
    synced.clear()
    begin = time.monotonic()
    while time.monotonic() < begin + 0.7:
        made.write(1, CDR, 5000)
        made.flush_if_due()
        time.sleep(0.01)
    assert 3 <= len(synced) <= 5
    assert set(synced) == {"sync run_0.mcap"}
    time.sleep(0.25)
    made.flush_if_due()
    synced.clear()
    time.sleep(0.25)
    made.flush_if_due()  # there is nothing new
    assert synced == []
    made.close()


def test_a_disk_that_took_nothing_is_not_trusted_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = filled(tmp_path / "run", flush_period=0.0, sync_period=0.01)

    def fail(descriptor: int) -> None:
        raise GONE

    with monkeypatch.context() as patch:
        patch.setattr(durable, "sync", fail)
        with pytest.raises(DataError, match=r"did not take what was written.*Input/output error"):
            made.flush_if_due()
    # Asked once more, an operating system says that all is well.
    with pytest.raises(DataError, match=r"did not take what was written"):
        made.close()
    assert inspect_bag(tmp_path / "run").closed


def test_file_systems_without_syncing_are_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unable(descriptor: int) -> None:
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))

    monkeypatch.setattr(os, "fsync", unable)
    filled(tmp_path / "run").close()
    assert inspect_bag(tmp_path / "run").messages == 10


def test_an_end_just_before_the_index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a kill leaves between metadata.yaml and the index counts as not closed, and is whole."""

    class Killed(BaseException):
        pass

    def killed(self: McapFile) -> None:
        raise Killed

    monkeypatch.setattr(McapFile, "finish", killed)
    with pytest.raises(Killed):
        filled(tmp_path / "run").close()
    monkeypatch.undo()
    assert read_metadata(tmp_path / "run").message_count == 10
    assert not is_closed(tmp_path / "run" / "run_0.mcap")
    salvage(tmp_path / "run", tmp_path / "out")
    with AnyReader([tmp_path / "out"]) as reader:
        assert reader.message_count == 10


def test_metadata_for_which_there_was_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = filled(tmp_path / "run")

    def full(folder: Path, metadata: BagMetadata) -> None:
        raise DataError("cannot write metadata.yaml: No space left on device")

    monkeypatch.setattr(writer, "write_metadata", full)
    with pytest.raises(DataError, match=r"No space left"):
        made.close()
    monkeypatch.undo()
    assert is_closed(tmp_path / "run" / "run_0.mcap")
    assert read_metadata(tmp_path / "run").message_count == 0
    reader = BagReader(tmp_path / "run")
    assert reader.outdated
    assert (reader.metadata.message_count, list(reader.topics)) == (10, ["/a"])
    assert "metadata.yaml is that of the beginning" in " ".join(inspect_bag(reader.path).warnings)
    salvage(tmp_path / "run", tmp_path / "out")
    with AnyReader([tmp_path / "out"]) as another:
        assert another.message_count == 10


def test_an_empty_bag_is_not_outdated(tmp_path: Path) -> None:
    filled(tmp_path / "run", count=0).close()
    assert not BagReader(tmp_path / "run").outdated
