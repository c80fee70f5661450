"""What every launched run does: start the nodes, have them conducted, stop all, the recorder last."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from rich.console import Console

from hri_sim.launch.conductor import Conductor
from hri_sim.launch.folder import RunFolders
from hri_sim.launch.held_signals import EndingSignals
from hri_sim.launch.recording_end import recording_words
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.launch.telling import print_line, why_broken

READY_TIMEOUT_S = 90.0


@dataclass(frozen=True)
class Ended:
    """How a run ended.

    Attributes:
        broken: What broke it off; none when it came to its end.
        killed: Nodes that had to be killed.
    """

    broken: BaseException | None
    killed: tuple[str, ...]


def conduct_nodes(
    conductor: Conductor,
    supervisor: Supervisor,
    specs: Sequence[NodeSpec],
    work: Callable[[], None],
    *,
    folders: RunFolders,
    signals: EndingSignals,
    console: Console,
    say: Callable[[str], None],
    stopping: str,
) -> Ended:
    """Start nodes, do the work when all are ready, stop them.

    Whatever breaks that off is handed back when the run had begun: then there is something to sum up.

    Args:
        conductor: Is closed at the end.
        supervisor: Has started nothing yet.
        specs: The nodes.
        work: What is conducted.
        folders: Of the run; kept from when it begins.
        signals: Of the end of the run.
        console: Gets lines that stay.
        say: Takes the live status.
        stopping: What is said when Ctrl-C ends the work.

    Raises:
        HriError, KeyboardInterrupt, SystemExit: what broke it off before it had begun.
    """
    broken: BaseException | None = None

    def tell(text: str) -> None:
        print_line(console, text)

    try:
        conductor.check_alone([spec.label for spec in specs])
        supervisor.start(specs)
        conductor.wait_ready(READY_TIMEOUT_S)
        folders.keep()
        work()
    except BaseException as error:  # also Ctrl-C
        if isinstance(error, KeyboardInterrupt) and conductor.begun:
            tell(stopping)
        conductor.break_off(why_broken(error))
        broken = error
    finally:
        signals.begin(conductor.insisted)
        conductor.close()
    say("stopping")
    until_ns = time.time_ns()
    killed = supervisor.stop(tell=tell, hurry=lambda: signals.count)
    if killed:
        tell(f"had to be killed: {', '.join(killed)}")
    if conductor.begun:
        for text in recording_words(supervisor, killed, folders.bag, until_ns):
            tell(text)
    if broken is not None and not conductor.begun:
        raise broken
    return Ended(broken, tuple(killed))
