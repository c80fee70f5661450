"""What the command lines of a run share: conduct it, show what came of it, end with an exit code."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import typer
from rich.console import Console

from hri_prediction.errors import HriError
from hri_sim.launch.folder import LOGS, holds_a_run
from hri_sim.launch.run import RunOptions, run_graph
from hri_sim.launch.summary import SUMMARY, print_table, succeeded
from hri_sim.launch.telling import explain, left_words, print_line
from hri_sim.media.frames import RunRecord


def _told(console: Console, what: str) -> AbstractContextManager[object]:
    """Say what takes a while: by a line that goes away, or in a file by one that stays."""
    if console.is_terminal:
        return console.status(what)
    console.print(what, highlight=False)
    return nullcontext()


def draw(
    record: RunRecord, folder: Path, console: Console, *, picture: bool, video: bool
) -> dict[str, Path]:
    """Draw what is asked for into a folder; the files by what they are."""
    from hri_sim.media.picture import draw_picture
    from hri_sim.media.video import render_video

    files = {}
    if picture:
        files["picture"] = folder / "picture.png"
        with _told(console, "drawing picture.png"):
            draw_picture(record, files["picture"])
    if video:
        files["video"] = folder / "video.mp4"
        with _told(console, "rendering video.mp4"):
            render_video(record, files["video"])
    return files


def conduct(options: RunOptions, console: Console, *, picture: bool, video: bool) -> int:
    """Run the graph, print the table, draw what is asked for, say where everything is.

    Returns:
        Exit code: 0, or 3 when a reach was not reached or the person was touched.

    Raises:
        typer.Exit: with code 1 when the run failed, 130 after Ctrl-C.
        SystemExit: with code 143 after SIGTERM, as the scripts turn it into one.
    """
    begin = time.monotonic()
    folder = options.out
    files = {"bag": options.bag or folder / "bag", "figures": folder / SUMMARY}
    # The folder of another run, which is refused, is left as it is.
    others = holds_a_run(folder)
    try:
        result = run_graph(options, console)
        print_table(console, result.summary)
        if result.series is not None:
            files |= draw(result.series.record, folder, console, picture=picture, video=video)
    except (HriError, OSError) as error:
        explain(error, console)
        for text in [] if others else left_words(folder, files["bag"]):
            print_line(console, text)
        raise typer.Exit(1) from error
    except (KeyboardInterrupt, SystemExit) as error:
        where = " before the run had begun"
        if (folder / LOGS).exists():
            where = f"; what was recorded is in {folder}, scripts/draw_run.py draws it"
        console.print(f"stopped{where}", highlight=False, markup=False, soft_wrap=True)
        if isinstance(error, SystemExit):
            raise
        raise typer.Exit(130) from None
    for name, path in files.items():
        console.print(f"{name + ':':<9}{path}", highlight=False, markup=False, soft_wrap=True)
    if options.person is not None:
        words = f"learnt:  scripts/people.py show {options.person} says what is known now"
        console.print(words, highlight=False, markup=False, soft_wrap=True)
    console.print(f"took {time.monotonic() - begin:.0f} s", highlight=False)
    return 0 if succeeded(result.summary) else 3
