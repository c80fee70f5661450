"""Command line of ``scripts/launch_dmp.py``: the whole graph with a policy of movement primitives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_planner.dmp.model_file import load_dmp
from hri_planner.pibb.experiment_file import find_experiment, load_experiment, shipped_experiments
from hri_planner.policy.model_file import find_dmp, shipped_dmps
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, HriError
from hri_sim.launch.command import conduct
from hri_sim.launch.deaths import ON_DEATH, STOP, OnDeath
from hri_sim.launch.folder import naming
from hri_sim.launch.options import (
    HUMANS,
    Human,
    HumanFile,
    Parameters,
    Picture,
    Place,
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
from hri_sim.readability.scene import policy_scenario
from hri_sim.scenario.schema import Scenario

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)

DEFAULT_POLICY = "dmp_transfer"


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def launch(
    policy: Annotated[
        str,
        typer.Option(
            help="What moves the robot: a .npz file of adapt_policy.py, or one that ships: "
            + ", ".join(shipped_dmps())
            + "."
        ),
    ] = DEFAULT_POLICY,
    experiment: Annotated[
        str,
        typer.Option(
            help="Where obstacles and the person's targets are: a .yaml file, or one that ships: "
            + ", ".join(shipped_experiments())
            + "."
        ),
    ] = "transfer",
    human: Human = "simulated",
    human_file: HumanFile = None,
    trial: Trial = None,
    place: Place = None,
    scenario: ScenarioFile = None,
    reaches: Annotated[
        int,
        typer.Option(help="Reaches to goals; after each but the last the robot goes back.", min=1),
    ] = 3,
    parameters: Parameters = None,
    record: Record = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/dmp_<time>.")
    ] = None,
    seed: Seed = 0,
    separation: Separation = DEFAULT_SEPARATION,
    on_death: OnDeath = STOP,
    picture: Picture = True,
    video: Video = False,
) -> None:
    """Launch the graph: simulator, person, policy, recorder, each its own process.

    The robot goes to goals of the policy in random order, and back to its start, while a person reaches
    for targets beside them. Then all nodes are stopped. Leaves a bag, summary.json, picture.png, a video
    if asked for, and the nodes' logs in the run's folder. Exit code 0: all reached, nobody touched; 1:
    something went wrong; 3: all nodes ran, but a reach was not reached or the person was touched (the
    table says); 130 after Ctrl-C, 143 after SIGTERM.
    """
    console = Console()
    try:
        with naming("--policy", policy):
            find_dmp(policy)
        drawn = None
        if scenario is None:
            drawn = _drawn(policy, experiment, seed, reaches)
        options = RunOptions(
            out=out or default_folder("dmp"),
            bag=record,
            seed=seed,
            separation=one_of("separation", separation, SEPARATIONS, WITHOUT),
            on_death=one_of("on-death", on_death, ON_DEATH),
            scenario=scenario,
            drawn=drawn,
            human=one_of("human", human, HUMANS),
            human_file=human_file,
            trial=trial,
            place=place,
            parameters=parameters,
            policy=policy,
        )
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    raise typer.Exit(conduct(options, console, picture=picture, video=video))


def _drawn(policy: str, experiment: str, seed: int, reaches: int) -> Scenario:
    """The scene of a policy in an experiment.

    Raises:
        ConfigError: when policy and experiment do not fit.
    """
    with naming("--experiment", experiment):
        found = load_experiment(find_experiment(experiment))
        found.check(load_robot())
    with naming("--policy", policy):
        ways = load_dmp(find_dmp(policy))
    if set(ways.names) != set(found.goals):
        raise ConfigError(
            f"--policy {policy} with goals {', '.join(ways.names)}",
            expected=f"those of --experiment {experiment}: {', '.join(found.goals)}",
            hint="give the experiment that the policy was learnt in",
        )
    found = found.with_(goals=dict(ways.goals), posture=ways.posture)
    with naming("--policy", policy):
        found.check(load_robot())
    return policy_scenario(found, load_robot(), ways, seed, reaches)


def main() -> int:
    """Entry point."""
    app(prog_name="launch_dmp.py")
    return 0
