"""Bags with known contents."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from hri_prediction.bags.metadata import OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter

START_NS = 1_700_000_000_000_000_000
STEP_NS = 4_000_000
STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def string_cdr(text: str) -> bytes:
    """CDR of a ``std_msgs/String``."""
    data = text.encode() + b"\x00"
    return b"\x00\x01\x00\x00" + struct.pack("<I", len(data)) + data


def number_cdr(number: int) -> bytes:
    """CDR of a ``std_msgs/UInt64``."""
    return b"\x00\x01\x00\x00" + struct.pack("<Q", number)


Row = tuple[str, bytes, int, int, int]


@pytest.fixture
def write_bag():
    """Writes a bag and returns its rows (topic, data, log, publish, sequence)."""

    def write(folder: Path, count: int = 500, **options) -> list[Row]:
        rows: list[Row] = []
        with BagWriter(folder, custom_data={"seed": "7"}, **options) as writer:
            writer.add_attachment("notes.txt", "text/plain", b"hello")
            channels = {
                "/words": writer.add_topic(
                    TopicInfo("/words", "std_msgs/msg/String", (OfferedQos(),), STRING_HASH)
                ),
                "/numbers": writer.add_topic(
                    TopicInfo(
                        "/numbers",
                        "std_msgs/msg/UInt64",
                        (OfferedQos(reliability="best_effort"),),
                    )
                ),
            }
            writer.add_topic(TopicInfo("/silent", "std_msgs/msg/String"))
            for index in range(count):
                topic = "/words" if index % 3 == 0 else "/numbers"
                data = string_cdr(f"word {index}") if index % 3 == 0 else number_cdr(index)
                log = START_NS + index * STEP_NS
                row = (topic, data, log, log - 100_000, index + 1)
                writer.write(channels[topic], *row[1:])
                rows.append(row)
        return rows

    return write
