"""For how long messages are in memory alone: what a recorder that is killed would lose."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Self

from mcap.reader import make_reader

from hri_prediction.closing import Closing

_PERIOD_S = 0.02


class FileGrowth(Closing):
    """Notes how a bag's file grows, while it is used as a context.

    Args:
        folder: Bag folder; it may not exist yet.

    Attributes:
        seen: When (system clock [ns]) the file had which size [bytes].
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.seen: list[tuple[int, int]] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="file growth", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def close(self) -> None:
        """Look no more."""
        self._stop.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._stop.wait(_PERIOD_S):
            for file in self._folder.glob("*.mcap"):
                # The time first: the file may only be larger then than it is believed to be.
                self.seen.append((time.time_ns(), file.stat().st_size))


def longest_unsaved_s(seen: Sequence[tuple[int, int]], file: Path) -> float:
    """Greatest age that a message in memory reached before it was in the file [s].

    Args:
        seen: When (system clock [ns]) the file had which size [bytes], in order.
        file: The file, closed, with the times of receipt as log times.
    """
    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    chunks = [
        (item.chunk_start_offset + item.chunk_length, item.message_start_time)
        for item in (summary.chunk_indexes if summary else ())
    ]
    longest = 0
    number = 0
    for time_ns, size in seen:
        while number < len(chunks) and chunks[number][0] <= size:
            number += 1
        if number < len(chunks):
            longest = max(longest, time_ns - chunks[number][1])
    return longest * 1e-9
