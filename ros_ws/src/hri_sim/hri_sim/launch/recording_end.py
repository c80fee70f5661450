"""What is said of the recording of a run that has ended."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from hri_prediction.bags.reader import is_closed
from hri_sim.launch.health import RECORDER
from hri_sim.launch.supervisor import Supervisor
from hri_sim.recording.folders import bag_folders

SALVAGE = "scripts/inspect_bag.py BAG --salvage OUT makes a whole one of it"


def recording_words(supervisor: Supervisor, killed: Collection[str], bag: Path) -> list[str]:
    """Lines about a recording that is not one whole bag; none when it is, or when there is none.

    Args:
        supervisor: Has stopped all nodes.
        killed: Nodes that it had to kill.
        bag: Bag folder, of a recorder that was started again the first one.
    """
    *earlier, last = bag_folders(bag) or [bag]
    if not earlier:
        return _words(supervisor, killed, bag)
    names = ", ".join(path.name for path in (*earlier, last))
    lines = [
        f"the recorder was started again: the recording is in {names} of {bag.parent}, with gaps "
        f"between; summary and picture are of {bag.name} alone"
    ]
    lines += [
        f"{path} was not closed, and ends where the recorder did; {SALVAGE}"
        for path in earlier
        if _unclosed(path)
    ]
    return [*lines, *_words(supervisor, killed, last)]


def _unclosed(bag: Path) -> bool:
    return any(not is_closed(file) for file in bag.glob("*.mcap"))


def _words(supervisor: Supervisor, killed: Collection[str], bag: Path) -> list[str]:
    if RECORDER in killed:
        return [f"{bag} was not closed: its last half second may be missing; {SALVAGE}"]
    code = supervisor.exit_code(RECORDER) or 0
    if code < 0:
        return [f"{bag} was not closed, and ends where the recorder did; {SALVAGE}"]
    if code == 0:
        return []
    # One that ended earlier has been named with its last words already.
    words = () if supervisor.died(RECORDER) else supervisor.last_words(RECORDER, 1)
    rest = f", and was not closed; {SALVAGE}" if _unclosed(bag) else ""
    return [*words, f"{bag} does not hold all that was sent{rest}"]
