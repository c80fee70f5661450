"""What is said of the recording of a run that has ended."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from hri_prediction.bags.reader import is_closed
from hri_sim.launch.health import RECORDER
from hri_sim.launch.supervisor import Supervisor

SALVAGE = "scripts/inspect_bag.py BAG --salvage OUT makes a whole one of it"


def recording_words(supervisor: Supervisor, killed: Collection[str], bag: Path) -> list[str]:
    """Lines about a recording that is not whole; none when it is, or when there is none.

    Args:
        supervisor: Has stopped all nodes.
        killed: Nodes that it had to kill.
        bag: Bag folder.
    """
    if RECORDER in killed:
        return [f"{bag} was not closed: its last half second may be missing; {SALVAGE}"]
    code = supervisor.exit_code(RECORDER) or 0
    if code < 0:
        return [f"{bag} was not closed, and ends where the recorder did; {SALVAGE}"]
    if code == 0:
        return []
    # One that ended earlier has been named with its last words already.
    words = () if supervisor.died(RECORDER) else supervisor.last_words(RECORDER, 1)
    unclosed = [file for file in bag.glob("*.mcap") if not is_closed(file)]
    rest = f", and was not closed; {SALVAGE}" if unclosed else ""
    return [*words, f"{bag} does not hold all that was sent{rest}"]
