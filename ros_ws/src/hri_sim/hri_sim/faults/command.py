"""Command line of ``scripts/reproduce_reliability.py``: what happens when things go wrong, measured."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import (
    available_cores,
    origin_line,
    results_origin,
    socket_line,
)
from hri_prediction.results.progress import ProgressLine
from hri_sim.faults.catalogue import FAULTS
from hri_sim.readability_report.run_folder import write_json
from hri_sim.reliability import encounters, table
from hri_sim.reliability.fault import PROCESSES, Fault, Result, Stays
from hri_sim.reliability.kept import bring_about

RESULTS = Path("docs/results")
RUNS, SMOKE_RUNS = Path("runs/reliability"), Path("runs/smoke_reliability")
FILE, TEXT, FIGURES = "reliability.json", "reliability.md", "results.json"
SMOKE_ENCOUNTERS = 30
DOMAIN = "76"
"""ROS domain of the graphs of faults, unless the environment names one."""
ENCOUNTERS = "encounters"
"""Name of the line that is no fault."""
NAMES = (ENCOUNTERS, *(fault.name for fault in FAULTS))

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def report(content: dict[str, Any], results: Sequence[Result]) -> str:
    """The text of ``reliability.md``.

    Args:
        content: Of ``reliability.json``.
        results: What came of the faults.
    """
    found = content["encounters"]
    smoke = " --smoke" if content["smoke"] else ""
    fewer = f" --at-most {content['at_most']}" if content.get("at_most") else ""
    text = [
        "# When things go wrong, measured\n",
        f"Made by `scripts/reproduce_reliability.py{smoke}{fewer}`. Nothing here is certified.\n",
        f"{origin_line(content['origin'])} {socket_line(content['origin'])}\n",
        *table.kept_lines(results, _words(content["origin"])),
        *(
            ["**A smoke run: its figures say that everything runs, and nothing else.**\n"]
            if smoke
            else []
        ),
        "| what | measured | wanted | verdict |",
        "| --- | --- | --- | --- |",
    ]
    if results:
        done = [result for result in results if result.trials or not result.skipped]
        met = sum(result.met for result in done)
        skipped = f", {len(results) - len(done)} skipped" if len(done) < len(results) else ""
        text.append(
            f"| faults that are answered as they should be, every time | {met} of {len(done)}{skipped} | "
            f"all | {_verdict(met == len(done))} |"
        )
    if found is not None:
        touched, number = encounters.touched(found), encounters.counted(found)
        moved = encounters.counted(found, "robot_moved")
        text.append(
            f"| people touched by a moving robot, in {number:,} encounters with a monitor that is to let "
            f"nobody be; in {moved:,} of them the robot moved | {touched} | 0 | {_verdict(not touched)} |"
        )
    text.append("")
    if results:
        text += ["## Faults\n", *table.lines(results)]
    if found is not None:
        text += ["## People who meet the robot\n", *encounters.lines(found)]
    return "\n".join(text)


def _close(stays: dict[str, Stays]) -> None:
    """End what stays open from one fault to the next."""
    while stays:
        stays.popitem()[1].close()


def _words(origin: dict[str, Any]) -> str:
    """Where something comes from, in a few words."""
    return f"{origin['commit']}, {origin['date']}"


def _verdict(met: bool) -> str:
    return "met" if met else "**missed**"


def chosen(only: Sequence[str]) -> tuple[bool, tuple[Fault, ...]]:
    """Whether the encounters are wanted, and which faults; all when none is named.

    Raises:
        ConfigError: when there is no line of a name.
    """
    for name in only:
        if name not in NAMES:
            raise ConfigError(f"--only {name}", expected="one of " + ", ".join(NAMES))
    faults = tuple(fault for fault in FAULTS if not only or fault.name in only)
    return not only or ENCOUNTERS in only, faults


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_reliability(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for reliability.md, reliability.json and, elsewhere than in docs/results, "
            "results.json. Default: docs/results; with --smoke or --only: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help="Folder of what is done, which is not done again. Default: runs/reliability; smoke: "
            "runs/smoke_reliability."
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(
            help="A line of the table by its name; may be given several times. Default: all of them. "
            "Names: " + ", ".join(NAMES)
        ),
    ] = None,
    count: Annotated[
        int | None,
        typer.Option(
            help="Repetitions of each fault. Default: as many as the table says.",
            min=1,
            show_default=False,
        ),
    ] = None,
    at_most: Annotated[
        int | None,
        typer.Option(
            help="Fewer repetitions where the table says more than that.", min=1, show_default=False
        ),
    ] = None,
    number: Annotated[
        int,
        typer.Option(
            "--encounters",
            help="Encounters with the monitor as it starts; of other settings a tenth of it. "
            f"Smoke: {SMOKE_ENCOUNTERS} at most.",
            min=3,
        ),
    ] = encounters.WANTED,
    first_seed: Annotated[int, typer.Option(help="Seed of the first of each kind.", min=0)] = 0,
    workers: Workers = None,
    smoke: Annotated[bool, typer.Option("--smoke", help="One of each, and a few people.")] = False,
) -> None:
    """Bring about faults, let people meet the robot, and make tables of what comes of it.

    Faults: nodes killed and frozen, motion capture, clocks, goals, disks and files gone wrong. People meet
    a robot whose speed the separation monitor scales. Graphs run in ROS domain 76, or that of
    ROS_DOMAIN_ID. What was broken off goes on where it stopped. Exit code 0: every bar is met; 3: one is
    missed.
    """
    console, origin = Console(), results_origin()
    # Beside a graph that somebody looks at, those of faults are to be neither heard nor in the way.
    os.environ.setdefault("ROS_DOMAIN_ID", DOMAIN)
    with_encounters, faults = chosen(only or ())
    runs = runs or (SMOKE_RUNS if smoke else RUNS)
    out = out or (runs if smoke or only else RESULTS)
    make_folders(runs=runs, out=out)
    meetings = min(number, SMOKE_ENCOUNTERS) if smoke else number
    cores = workers or available_cores()
    results: list[Result] = []
    found = None
    stays: dict[str, Stays] = {}
    with resumable(console, runs), ProgressLine(console) as progress:
        try:
            for fault in faults:
                if fault.kind != PROCESSES:
                    # What runs in virtual time needs no graph beside it, which takes half of the machine.
                    _close(stays)
                results.append(
                    bring_about(
                        fault,
                        min(
                            count or (fault.smoke if smoke else fault.count), at_most or sys.maxsize
                        ),
                        runs,
                        progress,
                        first_seed=first_seed,
                        smoke=smoke,
                        workers=cores,
                        stays=stays,
                        origin=_words(origin),
                    )
                )
        finally:
            _close(stays)
        if with_encounters:
            found = encounters.measure(meetings, first_seed, runs / "encounters", cores, progress)
    content = {
        "origin": origin,
        "smoke": smoke,
        "at_most": at_most,
        "faults": {result.fault.name: table.to_mapping(result) for result in results},
        "encounters": found,
    }
    write_json(out / FILE, content)
    (out / TEXT).write_text(report(content, results))
    missed = [result.fault.name for result in results if not result.met]
    touched = encounters.touched(found) if found is not None else 0
    if out != RESULTS:
        figures = {"missed": missed, "faults": content["faults"], "encounters": found}
        write_json(out / FIGURES, {**figures, "touched_by_moving_robot": touched})
    for result in results:
        words = (
            f"skipped: {result.skipped}" if result.skipped else "met" if result.met else "MISSED"
        )
        console.print(f"{result.fault.name}: {words}", highlight=False, soft_wrap=True)
    if found is not None:
        console.print(f"touched by a moving robot: {touched}, wanted 0", highlight=False)
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)
    raise typer.Exit(3 if touched or missed else 0)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_reliability.py")
    return 0
