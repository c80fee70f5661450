"""Command line of ``scripts/simulate_dyads.py``: bags of two simulated people in each case."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.ontology.cases import find_case
from hri_prediction.ontology.recordings import SESSIONS, write_sessions
from hri_prediction.results.options import make_folders, resumable
from hri_prediction.results.progress import ProgressLine
from hri_prediction.ros.arm_bag import write_arms_bag
from hri_prediction.tracks.placement import Placement
from hri_sim.ontology.layouts import POSITIONS
from hri_sim.ontology.sessions import (
    SHOWN_SEED,
    DyadStudy,
    Session,
    record_session,
    sessions_of,
)

PLACE = "0.85,0,-0.01,0"
"""Where the middle of their table top is in the world, as that of the dyad node."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def chosen(
    sessions: list[Session], cases: list[str], positions: list[str], people: int
) -> list[Session]:
    """Those sessions of a study that are wanted.

    Args:
        sessions: All.
        cases: Names or numbers; empty: all.
        positions: How people sit; empty: all.
        people: How many of those who did each case in a position.

    Raises:
        ConfigError: when there is no such case or position, or the study has none of a case in a position.
    """
    numbers = {find_case(name).number for name in cases}
    for position in positions:
        if position not in POSITIONS:
            raise ConfigError(f"--position {position!r}", expected="one of " + ", ".join(POSITIONS))
    found: list[Session] = []
    counts: dict[tuple[int, str], int] = {}
    for session in sessions:
        key = (session.case, session.position)
        if (numbers and session.case not in numbers) or (
            positions and session.position not in positions
        ):
            continue
        counts[key] = counts.get(key, 0) + 1
        if counts[key] <= people:
            found.append(session)
    if not found:
        raise ConfigError(
            f"nobody does --case {', '.join(cases)} sitting {', '.join(positions)}",
            expected="cases 1 to 3 in any position, the others frontal or orthogonal",
        )
    return found


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def simulate_dyads(
    out: Annotated[Path, typer.Option(help=f"New folder for the bags and {SESSIONS}.")],
    case: Annotated[
        list[str] | None,
        typer.Option(help="A case, 1 to 20; may be given several times. Default: all."),
    ] = None,
    position: Annotated[
        list[str] | None,
        typer.Option(help=f"How they sit: {', '.join(POSITIONS)}; several times. Default: all."),
    ] = None,
    people: Annotated[
        int, typer.Option(help="People of each case in a position, at most.", min=1)
    ] = 1,
    encounters: Annotated[int, typer.Option(help="How often both reach in a bag.", min=1)] = 16,
    seed: Annotated[
        int,
        typer.Option(
            help="Of people, places and all that they do; 0: of those that the shipped classifier has "
            "learnt.",
            min=0,
        ),
    ] = SHOWN_SEED,
) -> None:
    """Record simulated people in each case of the interaction ontology, as ordinary motion capture bags.

    Each bag has the arms of two bodies: to replay to the interaction monitor (scripts/replay_mocap.py), or
    to train on (scripts/train_ontology.py --data OUT).
    """
    console = Console()
    study = DyadStudy(encounters=encounters)
    sessions = chosen(sessions_of(study, seed), case or [], position or [], people)
    if out.is_dir() and any(out.iterdir()):
        raise ConfigError(f"--out {out} is not empty", hint="name a new folder")
    make_folders(out=out)
    place = Placement.parse(PLACE)
    entries: list[dict[str, Any]] = []
    # What is broken off leaves an empty folder, so that the same command can be given again.
    with (
        resumable(console, None),
        TemporaryDirectory(prefix=".part_", dir=out) as part,
        ProgressLine(console) as progress,
    ):
        progress.say("dyads")
        for session in sessions:
            name = f"{find_case(session.case).name}_{session.position.replace(' ', '_')}_{session.subject}"
            tracks = [track.transformed(place) for track in record_session(session, study)]
            about = {
                "task": tracks[0].task,
                "subject": session.subject,
                "source": tracks[0].source,
            }
            write_arms_bag(Path(part) / name, tracks, about)
            entries.append(
                {
                    "bag": name,
                    "case": session.case,
                    "subject": session.subject,
                    "position": session.position,
                }
            )
            progress.count(len(entries), len(sessions))
        write_sessions(Path(part) / SESSIONS, entries)
        for name in (*(entry["bag"] for entry in entries), SESSIONS):
            (Path(part) / name).rename(out / name)
    console.print(
        f"{len(entries)} bags, listed in {out / SESSIONS}", highlight=False, soft_wrap=True
    )


def main() -> int:
    """Entry point."""
    app(prog_name="simulate_dyads.py")
    return 0
