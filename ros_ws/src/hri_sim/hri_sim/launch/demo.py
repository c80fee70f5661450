"""Command line of ``scripts/demo``: three reaches through a person's space, recorded and shown."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_prediction.errors import HriError
from hri_sim.launch.ptomp import default_folder
from hri_sim.launch.run import RunOptions, explain, run_graph
from hri_sim.launch.summary import print_table, succeeded

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command()
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
    from hri_sim.media.picture import draw_picture
    from hri_sim.media.video import render_video

    console = Console()
    folder = out or default_folder("demo")
    begin = time.monotonic()
    try:
        result = run_graph(RunOptions(out=folder, seed=seed), console)
        print_table(console, result.summary)
        with console.status("drawing picture.png"):
            draw_picture(result.series.record, folder / "picture.png")
        if video:
            with console.status("rendering video.mp4"):
                render_video(result.series.record, folder / "video.mp4")
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        console.print(f"stopped; what was recorded is in {folder}", highlight=False)
        raise typer.Exit(130) from None
    console.print(
        f"picture: {folder / 'picture.png'}\n"
        + (f"video:   {folder / 'video.mp4'}\n" if video else "")
        + f"bag:     {folder / 'bag'}\n"
        f"figures: {folder / 'summary.json'}   ({time.monotonic() - begin:.0f} s)",
        highlight=False,
    )
    raise typer.Exit(0 if succeeded(result.summary) else 3)


def main() -> int:
    """Entry point."""
    app(prog_name="demo")
    return 0
