"""The bags of a run as one recording: it has several where its recorder was started again."""

from __future__ import annotations

import itertools
import math
import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hri_prediction.bags.condition import salvage_command
from hri_prediction.bags.inspect import BagReport, inspect_bag
from hri_prediction.bags.reader import BagReader
from hri_prediction.bags.salvage import NOT_SALVAGED
from hri_prediction.errors import DataError


@dataclass(frozen=True)
class RunBags:
    """What a run left of its recording.

    Attributes:
        readers: The bags that can be read, in the order in which they were begun.
        reports: How each of them was recorded.
        unread: Why others cannot be read.
    """

    readers: tuple[BagReader, ...]
    reports: tuple[BagReport, ...]
    unread: tuple[str, ...]

    @classmethod
    def of(cls, bags: Sequence[Path], *, allow_damaged: bool = False) -> RunBags:
        """Look through the bags of a run.

        Args:
            bags: Their folders, in the order in which they were begun.
            allow_damaged: Also take of damaged ones what is whole.

        Raises:
            DataError: none of them can be read.
        """
        readers, reports, errors = [], [], []
        for bag in bags:
            try:
                report = inspect_bag(bag, allow_damaged=allow_damaged)
            except DataError as error:
                errors.append(error)
                continue
            readers.append(BagReader(bag, allow_unclosed=True, allow_damaged=bool(report.damage)))
            reports.append(report)
        if not readers:
            raise errors[0]
        return cls(tuple(readers), tuple(reports), tuple(error.problem for error in errors))

    @property
    def topics(self) -> set[str]:
        """Topics of all bags."""
        return {topic for reader in self.readers for topic in reader.topics}

    @property
    def custom_data(self) -> dict[str, str]:
        """Provenance of the first bag."""
        return self.readers[0].custom_data

    def decoded(self, topics: Collection[str]) -> dict[str, list[tuple[int, Any]]]:
        """Topic to (publish time [ns], message)."""
        found: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in topics}
        for reader in self.readers:
            for message in reader.messages(topics):
                found[message.topic].append((message.publish_time_ns, message.decode()))
        return found

    @property
    def gaps_ns(self) -> tuple[tuple[int, int], ...]:
        """From the last message of a bag to the first one of the next [ns]."""
        spans = [
            (report.start_ns, report.start_ns + round(report.duration_s * 1e9))
            for report in self.reports
            if report.messages
        ]
        return tuple((end, begin) for (_, end), (begin, _) in itertools.pairwise(spans))

    @property
    def rates_hz(self) -> dict[str, float]:
        """Mean rate of each topic while it was recorded; 0 of fewer than two messages."""
        steps: dict[str, float] = {}
        spans: dict[str, float] = {}
        for topic in (topic for report in self.reports for topic in report.topics):
            known = math.isfinite(topic.rate_hz)
            more = topic.count - 1 if known else 0
            steps[topic.topic] = steps.get(topic.topic, 0) + more
            spans[topic.topic] = spans.get(topic.topic, 0.0) + (
                more / topic.rate_hz if known else 0
            )
        return {name: steps[name] / spans[name] if spans[name] else 0.0 for name in steps}

    @property
    def lost_messages(self) -> int:
        """Messages that were sent while a bag was recorded and are not in it, by sequence numbers."""
        return sum(topic.missing or 0 for report in self.reports for topic in report.topics)

    def unread_words(self) -> list[str]:
        """A line for each bag that cannot be read."""
        return [f"{problem}: nothing is taken from that bag" for problem in self.unread]

    def lost_words(self) -> list[str]:
        """A line for each bag in which messages are missing by their sequence numbers."""
        return [
            f"{lost} messages were sent and are not in {reader.path}: "
            f"scripts/inspect_bag.py {shlex.quote(str(reader.path))} says on which topics"
            for reader, report in zip(self.readers, self.reports, strict=True)
            if (lost := sum(topic.missing or 0 for topic in report.topics))
        ]

    def missing(self) -> list[str]:
        """What is missing from the recording, in words that name the bag."""
        said = self.unread_words()
        for reader, report in zip(self.readers, self.reports, strict=True):
            broken = [report.damage] if report.damage else []
            broken += [text for condition in report.conditions for text in condition.words()]
            said += [f"{reader.path}: {text}" for text in broken]
            if broken:
                said.append(f"{salvage_command(reader.path)} makes a whole bag of what can be read")
            if before := report.custom_data.get(NOT_SALVAGED):
                said.append(f"{reader.path} was salvaged from a bag that was not whole: {before}")
        said += self.lost_words()
        said += [
            f"nothing was recorded for {(begin - end) * 1e-9:.2f} s between two of its bags"
            for end, begin in self.gaps_ns
        ]
        return said
