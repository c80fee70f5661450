"""What is wrong with a recording, in words: which messages are lost, or about to be, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hri_sim.recording.recorder_core import RecorderState

BEHIND_S = 1.0
"""The disk has taken nothing for so long: worth a warning [s]."""
FULL_SHARE = 0.5
"""Likewise, when so much of the queue is taken."""
TRANSPORT = "transport"
"""Kind of the trouble that messages did not arrive: it is said from then on, as they stay lost."""
_NAMED = 3


@dataclass(frozen=True)
class Trouble:
    """One thing that is wrong.

    Attributes:
        kind: One word for it.
        text: What is wrong, which messages it costs.
        serious: Messages are lost for good, or nothing is written.
    """

    kind: str
    text: str
    serious: bool = False


def named(counts: Mapping[str, int]) -> str:
    """Topics with how many messages each, the most first, few of them by name."""
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    words = [f"{topic} {count}" for topic, count in ordered[:_NAMED]]
    rest = ordered[_NAMED:]
    if rest:
        words.append(f"{sum(count for _, count in rest)} on {len(rest)} more topics")
    return ", ".join(words)


def troubles(
    state: RecorderState,
    dropped: Mapping[str, int],
    transport: Mapping[str, int],
    unknown: Mapping[str, str],
) -> list[Trouble]:
    """All that is wrong, the worst first.

    Args:
        state: Figures of the recorder.
        dropped: Messages dropped since the queue was full, by topic.
        transport: Messages that were sent and did not arrive, by topic.
        unknown: Topics that are not recorded, with their types.
    """
    found = []
    waiting = f"{state.queued} messages wait, the queue is {state.queue_share * 100:.0f} % full"
    if state.error:
        found.append(Trouble("disk", f"not writing: {state.error}; {waiting}", serious=True))
    if dropped:
        text = f"{sum(dropped.values())} messages dropped: the queue was full ({named(dropped)})"
        found.append(Trouble("queue", text, serious=True))
    if not state.error:
        if state.behind_s > BEHIND_S:
            text = f"behind: the disk has taken nothing for {state.behind_s:.1f} s; {waiting}"
            found.append(Trouble("behind", text))
        elif state.queue_share >= FULL_SHARE:
            found.append(Trouble("behind", f"behind: {waiting}"))
    if unknown:
        text = f"{len(unknown)} topics of unknown types are not recorded: {', '.join(unknown)}"
        found.append(Trouble("types", text))
    if transport:
        text = f"{sum(transport.values())} messages lost in transport ({named(transport)})"
        found.append(Trouble(TRANSPORT, text))
    return found
