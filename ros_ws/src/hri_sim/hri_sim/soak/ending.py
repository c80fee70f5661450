"""What is looked at when a soak is over: its bags."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError

LOOK_EVERY = 10_000
"""Messages between two looks at whether reading is to be broken off."""


def bag_bytes(folder: Path) -> int:
    """Size of the files of a bag [bytes]; it may be written meanwhile."""
    total = 0
    for path in folder.glob("*.mcap"):
        try:
            total += path.stat().st_size
        except OSError:
            continue
    return total


def check_bag(folder: Path, hurried: Callable[[], bool] = lambda: False) -> dict[str, Any]:
    """Read a bag from its begin to its end.

    Args:
        folder: Of the bag.
        hurried: Whether that is to be broken off.

    Returns:
        Its name, size, whether it was closed, messages and seconds of recording; ``error`` says why it
        cannot be read, or that its index counts otherwise, and is empty when all is well.
    """
    found: dict[str, Any] = {
        "bag": folder.name,
        "bytes": bag_bytes(folder),
        "closed": False,
        "messages": 0,
        "seconds": 0.0,
        "error": "",
    }
    try:
        reader = BagReader(folder, allow_unclosed=True)
        found["closed"] = not reader.unclosed
        first = last = None
        for message in reader.messages():
            first = message.log_time_ns if first is None else min(first, message.log_time_ns)
            last = message.log_time_ns if last is None else max(last, message.log_time_ns)
            found["messages"] += 1
            if found["messages"] % LOOK_EVERY == 0 and hurried():
                found["error"] = "not read to its end: broken off"
                return found
        if first is not None and last is not None:
            found["seconds"] = round((last - first) * 1e-9, 3)
        counted = reader.metadata.message_count
        if found["closed"] and counted != found["messages"]:
            found["error"] = f"its index counts {counted} messages"
    except (DataError, OSError) as error:
        found["error"] = str(error)
    return found
