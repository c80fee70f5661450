"""Command line of ``scripts/launch_ptomp.py``: the whole graph with the replanning motion planner."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml
from rich.console import Console

from hri_prediction.errors import ConfigError, HriError
from hri_sim.launch.run import RunOptions, explain, run_graph
from hri_sim.launch.summary import print_table, succeeded

PLANNERS = ("ptomp",)
HUMANS = ("simulated", "replay")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def default_folder(kind: str) -> Path:
    """``runs/<kind>_<time>`` below the present folder."""
    return Path("runs") / f"{kind}_{time.strftime('%Y-%m-%d_%H-%M-%S')}"


def one_of(name: str, value: str, allowed: tuple[str, ...]) -> str:
    """The value, or a clear error that lists the allowed ones."""
    if value not in allowed:
        raise ConfigError(f"--{name} {value}", expected="one of " + ", ".join(allowed))
    return value


def read_parameters(path: Path | None) -> dict[str, dict[str, Any]]:
    """Parameters by node name from a YAML file ``{node: {parameter: value}}``.

    Raises:
        ConfigError: when it is not of that form.
    """
    if path is None:
        return {}
    try:
        values = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read {path}: {' '.join(str(error).split())}") from error
    if not isinstance(values, dict) or not all(isinstance(v, dict) for v in values.values()):
        raise ConfigError(f"{path} is not of the form 'node: {{parameter: value}}'")
    return values


@app.command()
def launch(
    planner: Annotated[str, typer.Option(help="Motion planner: ptomp.")] = "ptomp",
    human: Annotated[
        str, typer.Option(help="Where the person comes from: simulated or replay.")
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
            "scenario; with --human replay: none (constant velocity)."
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
) -> None:
    """Launch the graph: simulator, person, predictor, ptomp, recorder, each its own process.

    Conducts the reaches of a scenario, then stops all nodes. Leaves a bag, summary.json, picture.png
    and the nodes' logs in the run's folder. Exit code 0: all reached, nobody touched; 1: something
    went wrong; 3: all nodes ran, but a reach was not reached or the person was touched (the table says).
    """
    from hri_sim.media.picture import draw_picture

    console = Console(stderr=False)
    options = RunOptions(
        out=out or default_folder("ptomp"),
        bag=record,
        seed=seed,
        scenario=scenario,
        reaches=reaches,
        planner=one_of("planner", planner, PLANNERS),
        human=one_of("human", human, HUMANS),
        human_file=human_file,
        trial=trial,
        place=place,
        library=library,
        parameters=read_parameters(parameters),
    )
    try:
        result = run_graph(options, console)
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        console.print(f"stopped; what was recorded is in {options.out}", highlight=False)
        raise typer.Exit(130) from None
    print_table(console, result.summary)
    if picture:
        draw_picture(result.series.record, options.out / "picture.png")
    what = "bag, figures and picture" if picture else "bag and figures"
    console.print(f"{what}: {options.out}", highlight=False)
    raise typer.Exit(0 if succeeded(result.summary) else 3)


def main() -> int:
    """Entry point."""
    app(prog_name="launch_ptomp.py")
    return 0
