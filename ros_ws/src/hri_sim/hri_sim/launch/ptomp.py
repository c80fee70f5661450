"""Command line of ``scripts/launch_ptomp.py``: the whole graph with the replanning motion planner."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_planner.ptomp.variants import live_names, variants
from hri_sim.launch.command import conduct
from hri_sim.launch.deaths import ON_DEATH, STOP, OnDeath
from hri_sim.launch.options import (
    HUMANS,
    Human,
    HumanFile,
    Parameters,
    Picture,
    Place,
    ReachCount,
    Record,
    ScenarioFile,
    Seed,
    Trial,
    Video,
    default_folder,
    one_of,
)
from hri_sim.launch.run import RunOptions
from hri_sim.launch.separation import DEFAULT_SEPARATION, SEPARATIONS, WITHOUT, Separation

PLANNERS = live_names()
PEERS = ("ptomp", "itomp", "stomp")
"""Those that the help says more of than their names."""
OTHERS = tuple(name for name in PLANNERS if name not in PEERS)

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def _elsewhere(planner: str) -> str:
    """Where a planner that cannot be launched can be had."""
    from hri_sim.benchmark.adapted import ADAPTED  # the whole benchmark, for a mistake

    if planner in {name for name, _, _ in ADAPTED}:
        return "here a model is chosen by --parameters: 'ptomp: {adaptation_model: success_f8}'"
    if planner in variants():
        return f"{planner} is for scripts/benchmark_planners.py alone: no node predicts for it"
    return ""


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def launch(
    planner: Annotated[
        str,
        typer.Option(
            help="Motion planner: ptomp, its peers itomp (told that a reach goes on at constant velocity) "
            "and stomp (plans once, for as long as the motion is to take, before the robot sets off), or "
            "another of " + ", ".join(OTHERS) + "."
        ),
    ] = "ptomp",
    human: Human = "simulated",
    human_file: HumanFile = None,
    trial: Trial = None,
    place: Place = None,
    scenario: ScenarioFile = None,
    reaches: ReachCount = None,
    library: Annotated[
        Path | None,
        typer.Option(
            help="Task library of train_promp.py. Default: trained on simulated reaches of the "
            "scenario; with --person: none (what is learnt of them); with --human replay alone, or "
            "for itomp: none (constant velocity)."
        ),
    ] = None,
    person: Annotated[
        str | None,
        typer.Option(
            help="Learn the person who reaches under this name, instead of a library: optimal control "
            "guesses the reaches for the scenario's targets, each reach mends the guess. What is learnt "
            "is kept for the next run; scripts/people.py lists and deletes it."
        ),
    ] = None,
    parameters: Parameters = None,
    record: Record = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/ptomp_<time>.")
    ] = None,
    seed: Seed = 0,
    separation: Separation = DEFAULT_SEPARATION,
    on_death: OnDeath = STOP,
    picture: Picture = True,
    video: Video = False,
) -> None:
    """Launch the graph: simulator, person, predictor, ptomp, recorder, each its own process.

    Conducts the reaches of a scenario, then stops all nodes. Leaves a bag, summary.json, picture.png,
    a video if asked for, and the nodes' logs in the run's folder. Exit code 0: all reached, nobody
    touched; 1: something went wrong; 3: all nodes ran, but a reach was not reached or the person was
    touched (the table says); 130 after Ctrl-C, 143 after SIGTERM.
    """
    options = RunOptions(
        out=out or default_folder("ptomp"),
        bag=record,
        seed=seed,
        separation=one_of("separation", separation, SEPARATIONS, WITHOUT),
        on_death=one_of("on-death", on_death, ON_DEATH),
        scenario=scenario,
        reaches=reaches,
        planner=one_of("planner", planner, PLANNERS, _elsewhere(planner)),
        human=one_of("human", human, HUMANS),
        human_file=human_file,
        trial=trial,
        place=place,
        library=library,
        person=person,
        parameters=parameters,
    )
    raise typer.Exit(conduct(options, Console(), picture=picture, video=video))


def main() -> int:
    """Entry point."""
    app(prog_name="launch_ptomp.py")
    return 0
