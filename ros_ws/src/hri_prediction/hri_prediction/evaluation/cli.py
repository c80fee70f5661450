"""Command line of ``scripts/compare_prediction.py``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hri_prediction.config import load_yaml
from hri_prediction.evaluation.comparison import FIGURES, Comparison, compare_bags
from hri_prediction.prediction.config import PredictorConfig

DIFFERENT = 3
"""Exit code when a recorded prediction is not the one made offline."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def show(found: Comparison, console: Console) -> None:
    """Print the figures of one body."""
    table = Table(box=None, pad_edge=False, show_header=False, title=Text(found.body))
    table.title_justify = "left"
    table.add_column()
    table.add_column(justify="right")
    table.add_row("samples", str(found.samples))
    table.add_row("  of which recorded beside the predictions", str(found.recorded))
    table.add_row("predictions", str(found.predictions))
    table.add_row("  of a reach", str(found.reaching))
    table.add_row("  invalid", str(found.invalid))
    table.add_row("  of a sample that is not there", str(found.strange))
    table.add_row("  that say something else than offline", str(found.different))
    for name, value in zip(FIGURES, found.largest, strict=True):
        table.add_row(Text(f"largest difference of {name}"), f"{value:.3g}")
    console.print(table, highlight=False)
    if found.same:
        console.print("the same as offline", highlight=False)
        return
    console.print(
        f"not the same as offline, first {found.first_s:.3f} s after the first sample. Was it another "
        "library or configuration (--library, --config), or did samples not arrive (dropped … on "
        "/diagnostics)?",
        highlight=False,
        soft_wrap=True,
    )


@app.command()
def compare_prediction(
    predicted: Annotated[
        Path, typer.Argument(help="Bag with predictions and arms, as the recorder makes it.")
    ],
    source: Annotated[
        Path | None,
        typer.Option(
            help="Bag that was replayed (at speed 1, not placed), to predict from its samples "
            "instead of the received ones."
        ),
    ] = None,
    library: Annotated[
        Path | None, typer.Option(help="Task library (default: the one that the predictions name).")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="YAML file with the PredictorConfig that the node had.")
    ] = None,
) -> None:
    """Hold recorded predictions against those that the predictor makes offline from the same samples.

    Exit codes: 0 they are the same, 1 a file cannot be used, 2 wrong arguments, 3 they are not.
    """
    settings = load_yaml(PredictorConfig, config) if config else None
    console = Console()
    with Console(stderr=True).status("predicting"):
        found = compare_bags(predicted, source, library, settings)
    for item in found:
        show(item, console)
    if not all(item.same for item in found):
        raise typer.Exit(DIFFERENT)


def main() -> int:
    """Entry point."""
    app(prog_name="compare_prediction.py")
    return 0
