"""Stamps: ROS time messages and integer nanoseconds."""

from __future__ import annotations

from typing import Any

from builtin_interfaces.msg import Time

NANO = 1_000_000_000


def to_ns(stamp: Any) -> int:
    """Nanoseconds of a ``builtin_interfaces/Time``."""
    return int(stamp.sec) * NANO + int(stamp.nanosec)


def to_time(stamp_ns: int) -> Time:
    """``builtin_interfaces/Time`` of nanoseconds (negative times count as zero)."""
    seconds, nanoseconds = divmod(max(int(stamp_ns), 0), NANO)
    return Time(sec=seconds, nanosec=nanoseconds)


def seconds_to_ns(seconds: float) -> int:
    """Nanoseconds, rounded to the nearest."""
    return round(seconds * 1e9)
