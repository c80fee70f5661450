"""Bags are read from begin to end when a soak is over."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from hri_prediction.bags.metadata import TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_sim.recording.folders import bag_folders
from hri_sim.soak import ending
from hri_sim.soak.ending import bag_bytes, check_bag

STEP_NS = 4_000_000


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag of 100 numbers."""
    with BagWriter(tmp_path / "bag") as writer:
        channel = writer.add_topic(TopicInfo("/numbers", "std_msgs/msg/UInt64"))
        for number in range(100):
            data = b"\x00\x01\x00\x00" + struct.pack("<Q", number)
            writer.write(channel, data, 1 + number * STEP_NS, 1, number + 1)
    return tmp_path / "bag"


def test_a_whole_bag(bag: Path) -> None:
    found = check_bag(bag)
    assert found == {
        "bag": "bag",
        "bytes": bag_bytes(bag),
        "closed": True,
        "messages": 100,
        "seconds": pytest.approx(99 * 0.004, abs=1e-3),
        "error": "",
    }
    assert bag_folders(bag) == [bag]


def test_a_bag_whose_recorder_was_killed(bag: Path) -> None:
    (file,) = bag.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-200])
    found = check_bag(bag)
    assert not found["closed"]
    assert found["messages"] == 100
    assert found["error"] == ""


def test_damage_and_no_bag(bag: Path, tmp_path: Path) -> None:
    (file,) = bag.glob("*.mcap")
    content = bytearray(file.read_bytes())
    content[len(content) // 4] ^= 0xFF
    file.write_bytes(content)
    assert check_bag(bag)["error"]
    assert "there is no bag" in check_bag(tmp_path / "bag_2")["error"]


def test_who_is_in_a_hurry_does_not_wait(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ending, "LOOK_EVERY", 10)
    found = check_bag(bag, lambda: True)
    assert found["messages"] == 10
    assert "broken off" in found["error"]
