"""Command line of ``scripts/launch_ptomp.py``: the whole graph with the replanning motion planner."""

from __future__ import annotations

import difflib
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_planner.ptomp.variants import live_names, variants
from hri_prediction.errors import ConfigError
from hri_sim.benchmark.adapted import ADAPTED
from hri_sim.launch.command import conduct
from hri_sim.launch.run import RunOptions

PLANNERS = live_names()
PEERS = ("ptomp", "itomp", "stomp")
"""Those that the help says more of than their names."""
OTHERS = tuple(name for name in PLANNERS if name not in PEERS)
HUMANS = ("simulated", "replay")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def default_folder(kind: str) -> Path:
    """``runs/<kind>_<time>`` below the present folder."""
    return Path("runs") / f"{kind}_{time.strftime('%Y-%m-%d_%H-%M-%S')}"


def one_of(name: str, value: str, allowed: tuple[str, ...], hint: str = "") -> str:
    """The value, or a clear error that lists those that are meant, or all allowed ones."""
    if value not in allowed:
        near = difflib.get_close_matches(value, allowed, 3)
        raise ConfigError(
            f"--{name} {value}",
            expected="one like " + ", ".join(near) if near else "one of " + ", ".join(allowed),
            hint=hint or f"give --{name} {allowed[0]}, or leave it out",
        )
    return value


def _elsewhere(planner: str) -> str:
    """Where a planner that cannot be launched can be had."""
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
    human: Annotated[
        str,
        typer.Option(
            help="Where the person comes from: simulated or replay. Live motion capture is for "
            "nodes that are started by hand (mocap_live)."
        ),
    ] = "simulated",
    human_file: Annotated[
        Path | None, typer.Option(help="Recording to replay: mocap bag or track file.")
    ] = None,
    trial: Annotated[int | None, typer.Option(help="Trial of the recording, from 0.")] = None,
    place: Annotated[
        str | None,
        typer.Option(
            help="Where the recording is put: X,Y,Z,YAW in metres and degrees. "
            "Default: seated across the table, facing the robot."
        ),
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option(help="Scenario file (YAML). Default: drawn by the seed.")
    ] = None,
    reaches: Annotated[int | None, typer.Option(help="Reaches of a drawn scenario.")] = None,
    library: Annotated[
        Path | None,
        typer.Option(
            help="Task library of train_promp.py. Default: trained on simulated reaches of the "
            "scenario; with --human replay, or for itomp: none (constant velocity)."
        ),
    ] = None,
    parameters: Annotated[
        Path | None, typer.Option(help="YAML file with parameters: 'node: {parameter: value}'.")
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="Bag folder to create. Default: bag in --out.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/ptomp_<time>.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of everything random.", min=0)] = 0,
    picture: Annotated[bool, typer.Option(help="Draw picture.png at the end.")] = True,
    video: Annotated[bool, typer.Option(help="Render video.mp4 after the run.")] = False,
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
        scenario=scenario,
        reaches=reaches,
        planner=one_of("planner", planner, PLANNERS, _elsewhere(planner)),
        human=one_of("human", human, HUMANS),
        human_file=human_file,
        trial=trial,
        place=place,
        library=library,
        parameters=parameters,
    )
    raise typer.Exit(conduct(options, Console(), picture=picture, video=video))


def main() -> int:
    """Entry point."""
    app(prog_name="launch_ptomp.py")
    return 0
