"""What the recorder of a soak did not get, or did not keep, by its own count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hri_sim.soak.faults import PAUSE

RECORDER = "recorder"
COUNTS = "dropped", "lost_in_transport"
AFTER_S = 3.0
"""So long after it goes on, a recorder tells of what it lost while it stood still [s]."""


@dataclass(frozen=True)
class Lost:
    """Messages that are in no bag.

    Attributes:
        running: While the recorder ran.
        standing: While it stood still by a fault, or was told so right after.
    """

    running: int
    standing: int


def lost_messages(
    samples: Sequence[dict[str, Any]], faults: Sequence[dict[str, Any]]
) -> Lost | None:
    """Count what the recorder's health says more from each sample to the next.

    One that was started again begins anew: what is sent while there is none is not lost by it.

    Args:
        samples: Of the record of a soak.
        faults: Likewise.

    Returns:
        None when the recorder has said nothing.
    """
    stood = [
        (fault["s"], fault["s"] + fault["seconds"] + AFTER_S)
        for fault in faults
        if fault["fault"] == PAUSE and fault["node"] == RECORDER
    ]
    counts = [
        (sample["s"], sum(own.get(name, 0.0) for name in COUNTS))
        for sample in samples
        for own in [sample["figures"].get(RECORDER, {})]
        if own
    ]
    if not counts:
        return None
    found = {False: 0, True: 0}
    before = 0.0
    for second, count in counts:
        more = round(count - before) if count >= before else round(count)
        found[any(begin <= second <= end for begin, end in stood)] += more
        before = count
    return Lost(found[False], found[True])
