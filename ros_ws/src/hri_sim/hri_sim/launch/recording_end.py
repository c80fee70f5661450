"""What is said of the recording of a run that has ended."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from hri_prediction.bags.condition import salvage_command
from hri_prediction.bags.reader import BagReader, is_closed
from hri_prediction.errors import DataError
from hri_prediction.ros.time import NANO
from hri_sim.launch.health import RECORDER
from hri_sim.launch.supervisor import Supervisor
from hri_sim.recording.folders import bag_folders


def recording_words(
    supervisor: Supervisor, killed: Collection[str], bag: Path, until_ns: int
) -> list[str]:
    """Lines about a recording that is not one whole bag; none when it is, or when there is none.

    Args:
        supervisor: Has stopped all nodes.
        killed: Nodes that it had to kill.
        bag: Bag folder, of a recorder that was started again the first one.
        until_ns: When the run ended, before its nodes were stopped, on the clock of its messages [ns].
    """
    *earlier, last = bag_folders(bag) or [bag]
    if not earlier:
        return _words(supervisor, killed, bag, until_ns)
    names = ", ".join(path.name for path in (*earlier, last))
    lines = [
        f"the recorder was started again: the recording is in {names} of {bag.parent}, with gaps "
        "between; summary and picture are of all of them together"
    ]
    lines += [
        f"{path} was not closed, and ends where the recorder did; {_salvage(path)}"
        for path in earlier
        if _unclosed(path)
    ]
    return [*lines, *_words(supervisor, killed, last, until_ns)]


def _salvage(bag: Path) -> str:
    return f"{salvage_command(bag)} makes a whole one of it"


def _missing(bag: Path, until_ns: int) -> str:
    """What a bag that was not closed does not hold, by its last message."""
    try:
        last_ns = max(one.last_ns for one in BagReader(bag, allow_damaged=True).conditions)
    except DataError:
        last_ns = 0
    if not last_ns:
        return "holds no message that can be read"
    missing_s = (until_ns - last_ns) / NANO
    if missing_s <= 0.0:
        return "holds messages up to the end of the run; what came while nodes were stopped may be missing"
    return f"has no message of the last {missing_s:.1f} s of the run"


def _unclosed(bag: Path) -> bool:
    return any(not is_closed(file) for file in bag.glob("*.mcap"))


def _words(supervisor: Supervisor, killed: Collection[str], bag: Path, until_ns: int) -> list[str]:
    code = supervisor.exit_code(RECORDER) or 0
    if RECORDER in killed or code < 0:
        return [f"{bag} was not closed, and {_missing(bag, until_ns)}; {_salvage(bag)}"]
    if code == 0:
        return []
    # One that ended earlier has been named with its last words already.
    words = () if supervisor.died(RECORDER) else supervisor.last_words(RECORDER, 1)
    rest = f", and was not closed; {_salvage(bag)}" if _unclosed(bag) else ""
    return [*words, f"{bag} does not hold all that was sent{rest}"]
