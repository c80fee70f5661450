"""Command line of ``scripts/launch_rnn.py``: the whole graph with a policy that was learnt from people."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_planner.policy.model_file import find_network
from hri_planner.rnn.model_file import shipped_policies
from hri_prediction.errors import HriError
from hri_sim.launch.command import conduct
from hri_sim.launch.deaths import ON_DEATH, STOP, OnDeath
from hri_sim.launch.folder import naming
from hri_sim.launch.moving_goals import SCENES
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
from hri_sim.launch.telling import explain

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def launch(
    scene: Annotated[
        str,
        typer.Option(help="; ".join(f"{name}: {what}" for name, what in SCENES.items()) + "."),
    ] = "sequence",
    policy: Annotated[
        str,
        typer.Option(
            help="What moves the robot: a .npz file of train_rnn.py, or one that ships: "
            + ", ".join(shipped_policies())
            + "."
        ),
    ] = DEFAULT_POLICY,
    human: Human = "simulated",
    human_file: HumanFile = None,
    trial: Trial = None,
    place: Place = None,
    scenario: ScenarioFile = None,
    reaches: ReachCount = None,
    parameters: Parameters = None,
    record: Record = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/rnn_<time>.")
    ] = None,
    seed: Seed = 0,
    separation: Separation = DEFAULT_SEPARATION,
    on_death: OnDeath = STOP,
    picture: Picture = True,
    video: Video = False,
) -> None:
    """Launch the graph: simulator, person, policy, recorder, each its own process.

    Conducts the reaches of a scene, then stops all nodes. Leaves a bag, summary.json, picture.png, a
    video if asked for, and the nodes' logs in the run's folder. Exit code 0: all reached, nobody
    touched; 1: something went wrong; 3: all nodes ran, but a reach was not reached or the person was
    touched (the table says); 130 after Ctrl-C, 143 after SIGTERM.
    """
    console = Console()
    try:
        with naming("--policy", policy):
            find_network(policy)
        options = RunOptions(
            out=out or default_folder("rnn"),
            bag=record,
            seed=seed,
            separation=one_of("separation", separation, SEPARATIONS, WITHOUT),
            on_death=one_of("on-death", on_death, ON_DEATH),
            scenario=scenario,
            reaches=reaches,
            human=one_of("human", human, HUMANS),
            human_file=human_file,
            trial=trial,
            place=place,
            parameters=parameters,
            policy=policy,
            scene=one_of("scene", scene, tuple(SCENES)),
        )
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    raise typer.Exit(conduct(options, console, picture=picture, video=video))


def main() -> int:
    """Entry point."""
    app(prog_name="launch_rnn.py")
    return 0
