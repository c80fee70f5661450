"""What of a file that was not closed, or is damaged, can be read, and what is missing from it."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from hri_prediction.bags.metadata import METADATA_FILE
from hri_prediction.bags.scan import ScanResult

_LAST_NS = 253_402_300_799 * 10**9  # of the year 9999; damaged times may be any


def salvage_command(path: Path) -> str:
    """The command that makes a whole bag of one that is not, with its path."""
    bag = path
    if path.suffix == ".mcap" and (path.parent / METADATA_FILE).exists():
        bag = path.parent
    bag = bag if bag.name else bag.absolute()
    out = bag.with_name(f"{bag.name.removesuffix('.mcap')}_salvaged")
    return f"scripts/inspect_bag.py {shlex.quote(str(bag))} --salvage {shlex.quote(str(out))}"


def clock_time(time_ns: int) -> str:
    """A log time as people read it."""
    return (
        f"{datetime.fromtimestamp(min(time_ns, _LAST_NS) * 1e-9, tz=UTC):%Y-%m-%d %H:%M:%S.%f} UTC"
    )


@dataclass(frozen=True)
class Condition:
    """What a scan from its front found of a file.

    Attributes:
        file: Its name.
        closed: Whether it ends as it should.
        size_bytes: Its size.
        read_bytes: Up to where its records are whole.
        messages: Messages that can be read.
        last_ns: Log time of the last of these [ns], 0 when there is none.
        partial_messages: Those of them from the chunk in which the file ends; no checksum covers them.
        cut_bytes: Unpacked bytes of that chunk that are lost, by what it says of its size.
        cut_until_ns: Log time of its last message, likewise [ns]; 0 when no chunk is cut.
        damaged_chunks: Chunks whose messages are lost, as their checksum or compression is wrong.
        broken: Damaged places between chunks, behind which the next whole chunk was looked for.
        orphans: Messages that are lost as their topic is not known.
    """

    file: str
    closed: bool
    size_bytes: int
    read_bytes: int
    messages: int
    last_ns: int
    partial_messages: int
    cut_bytes: int
    cut_until_ns: int
    damaged_chunks: int
    broken: int
    orphans: int

    @classmethod
    def of(cls, file: str, found: ScanResult) -> Condition:
        """That of a file whose scan is complete."""
        return cls(
            file=file,
            closed=found.closed,
            size_bytes=found.size,
            read_bytes=found.read,
            messages=found.messages,
            last_ns=found.last_ns,
            partial_messages=found.partial_messages,
            cut_bytes=found.cut_bytes,
            cut_until_ns=found.cut_until_ns,
            damaged_chunks=found.damaged_chunks,
            broken=found.broken,
            orphans=found.orphans,
        )

    def words(self) -> tuple[str, ...]:
        """What is not whole, in lines that name the file; none of a whole one."""
        said = []
        if not self.closed:
            said.append("was not closed: its recorder was killed, or the file is cut")
        if self.damaged_chunks:
            said.append(f"is damaged: the messages of {self.damaged_chunks} of its chunks are lost")
        if self.broken:
            said.append(
                f"is damaged between chunks, {self.broken} times: messages may be missing there"
            )
        if self.orphans:
            said.append(f"holds {self.orphans} messages of topics that are not described any more")
        if self.read_bytes < self.size_bytes:
            said.append(
                f"is whole up to byte {self.read_bytes:,} of {self.size_bytes:,}; "
                f"the {self.size_bytes - self.read_bytes:,} behind that are no whole record"
            )
        elif not self.closed:
            said.append(f"holds whole records alone, in all of its {self.size_bytes:,} bytes")
        if self.cut_until_ns:
            said.append(
                f"ends within a chunk: {self.partial_messages} messages of it were read, which no checksum "
                f"covers; {self.cut_bytes:,} bytes of messages up to {clock_time(self.cut_until_ns)} "
                "are lost"
            )
        if said and not self.messages:
            said.append("has no message that can be read")
        elif not self.closed:
            said.append(f"has no message after {clock_time(self.last_ns)}")
        return tuple(f"{self.file} {text}" for text in said)
