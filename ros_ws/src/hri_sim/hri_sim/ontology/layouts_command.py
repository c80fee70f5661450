"""Command line of ``scripts/find_layouts.py``: places in which each case is what happens."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from hri_prediction.ontology.cases import REDUCED, cases, find_case
from hri_prediction.results.options import Workers, make_folders
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.layout_file import save_layouts
from hri_sim.ontology.layouts import POSITIONS, Layout, find_layout
from hri_sim.ontology.pictures import draw_layouts

FILE = "layouts.json"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)

_Group = tuple[tuple[int, ...], str]


def find_group(job: _Group) -> dict[tuple[int, str], Layout]:
    """Layouts of the cases of a group of the reduced ontology in a position: all begin from the first's."""
    numbers, position = job
    found: dict[tuple[int, str], Layout] = {}
    for number in numbers:
        rng = np.random.default_rng([number, *position.encode()])
        near = found.get((numbers[0], position))
        found[number, position] = find_layout(find_case(number), position, rng, near)
    return found


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def find_layouts(
    out: Annotated[Path, typer.Option(help=f"Folder for {FILE} and a picture of each position.")],
    workers: Workers = None,
) -> None:
    """Search the places of all twenty cases in all positions, so that the edges of each are there.

    Those that simulated dyads have ship as hri_sim/ontology/layouts.json: the search is chaotic, and on
    another processor it may end elsewhere.
    """
    console = Console()
    make_folders(out=out)
    jobs: list[_Group] = [(group, position) for position in POSITIONS for group in REDUCED]
    layouts: dict[tuple[int, str], Layout] = {}
    with ProgressLine(console) as progress:
        progress.say("layouts")
        with closing(do_all(find_group, jobs, workers=workers or available_cores())) as results:
            for one in results:
                layouts |= one
                progress.count(len(layouts), len(cases()) * len(POSITIONS))
    save_layouts(out / FILE, layouts, origin=results_origin())
    for position in POSITIONS:
        shown = {f"case {one.number}": layouts[one.number, position] for one in cases()}
        draw_layouts(out / f"{position.replace(' ', '_')}.png", shown)
    console.print(f"{out / FILE}: {len(layouts)} layouts", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="find_layouts.py")
    return 0
