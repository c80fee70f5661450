"""Command line of ``scripts/demo``: three reaches through a person's space, recorded and shown."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_sim.launch.command import conduct
from hri_sim.launch.ptomp import default_folder
from hri_sim.launch.run import RunOptions

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def demo(
    seed: Annotated[int, typer.Option(help="Seed of scenario, person and planner.", min=0)] = 100,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/demo_<time>.")
    ] = None,
    video: Annotated[bool, typer.Option(help="Render video.mp4 after the run.")] = True,
) -> None:
    """A robot arm and a simulated person reach three times through the same space.

    Sets up the project on the first run. Launches simulator, person, predictor, planner and recorder,
    and leaves summary.json, picture.png, video.mp4 and the bag in the folder of the run. The baseline
    is the same scene and person in the same simulator without replanning. Exit code 0: all reached and
    nobody touched.
    """
    options = RunOptions(out=out or default_folder("demo"), seed=seed)
    raise typer.Exit(conduct(options, Console(), picture=True, video=video))


def main() -> int:
    """Entry point."""
    app(prog_name="demo")
    return 0
