"""Command line of the training: ``train_promp FILES... --out DIR``."""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from hri_prediction.config import load_yaml
from hri_prediction.errors import HriError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.training import TASK_FIELDS, TrainingResult, train_from_files
from hri_prediction.results.folder import check_folder
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.results.progress import ProgressLine

_SMOKE_TRACKS = 5
_OUTPUTS = ("library.npz", "results.json", "results.md", "wrist.png")
_COLUMNS = ("task", "side", "reaches", "subjects", "duration s", "misfit mm", "end spread mm")

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def _rows(result: TrainingResult) -> list[tuple[str, ...]]:
    return [
        (
            t.name,
            t.side,
            str(t.demonstrations),
            str(t.subjects),
            f"{t.duration_mean_s:.2f} ± {t.duration_std_s:.2f}",
            f"{t.residual_mm:.2f}",
            f"{t.end_spread_mm:.1f}",
        )
        for t in result.tasks
    ]


def markdown_table(result: TrainingResult) -> str:
    """The report of a training as a Markdown table."""
    lines = ["| " + " | ".join(_COLUMNS) + " |", "|" + " --- |" * len(_COLUMNS)]
    lines += ["| " + " | ".join(row) + " |" for row in _rows(result)]
    return "\n".join(lines) + "\n"


def plot_library(result: TrainingResult, path: Path, rng: np.random.Generator) -> None:
    """Draw the wrist's mean ± 2 standard deviations over the phase, reaches and samples.

    Args:
        result: A training.
        path: PNG to write.
        rng: Draws the three sample paths shown for each task.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    tasks = result.library.tasks
    figure = Figure(figsize=(10.0, 2.4 * len(tasks) + 0.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(tasks), 3, squeeze=False, sharex=True)
    phases = np.linspace(0.0, 1.0, 61)
    for row, task in enumerate(tasks):
        mean = task.promp.trajectory_mean(phases)
        variance = np.diagonal(task.promp.trajectory_covariance(phases), axis1=1, axis2=2)
        draws = task.promp.sample(phases, rng, 3)
        for column, name in enumerate("xyz"):
            axis, d = axes[row, column], 3 + column
            for demo in result.demonstrations[row]:
                axis.plot(demo.phases, demo.values[:, d], color="0.6", lw=0.5)
            for draw in draws:
                axis.plot(phases, draw[:, d], color="tab:orange", lw=0.7, ls="--")
            deviation = 2.0 * np.sqrt(variance[:, d])
            axis.plot(phases, mean[:, d], color="tab:blue")
            axis.fill_between(
                phases, mean[:, d] - deviation, mean[:, d] + deviation, color="tab:blue", alpha=0.2
            )
            axis.set_title(f"{task.name} ({task.side}): wrist {name} [m]", fontsize=9)
            if row == len(tasks) - 1:
                axis.set_xlabel("phase")
    figure.suptitle(
        "grey: training reaches; blue: mean ± 2 standard deviations; dashed: samples", fontsize=9
    )
    figure.savefig(path, dpi=110)


def write_results(result: TrainingResult, out: Path, seed: int, origin: dict[str, Any]) -> None:
    """Write library.npz, results.json, results.md and wrist.png into ``out``."""
    out.mkdir(parents=True, exist_ok=True)
    result.library.save(out / "library.npz")
    content = {
        "tasks": [dataclasses.asdict(t) for t in result.tasks],
        "upper_arm_m": result.library.upper_arm_m,
        "forearm_m": result.library.forearm_m,
        "place": result.library.place,
        "facing_deg": result.library.facing_deg,
        "skipped": list(result.skipped),
        "seed": seed,
        "origin": origin,
    }
    (out / "results.json").write_text(json.dumps(content, indent=1) + "\n")
    (out / "results.md").write_text(f"{origin_line(origin)}\n\n{markdown_table(result)}")
    plot_library(result, out / "wrist.png", np.random.default_rng(seed))


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def train_promp(
    files: Annotated[
        list[Path],
        typer.Argument(help="Recordings of reaches: track files (NPZ, CSV, QTM TSV) or bags."),
    ],
    out: Annotated[Path, typer.Option(help="Folder for library.npz, results.json, table, plot.")],
    task_from: Annotated[
        str,
        typer.Option(
            help="What names a task: "
            + ", ".join(TASK_FIELDS)
            + ". movement tells the reaches of a "
            "continuous recording apart by start and end."
        ),
    ] = "task",
    leave_out_subject: Annotated[
        str, typer.Option(help="Subject whose reaches are kept out, to test on.")
    ] = "",
    leave_out_trial: Annotated[
        int | None, typer.Option(help="Trial kept out; with a subject, only that subject's.")
    ] = None,
    place: Annotated[
        str,
        typer.Option(
            help="How people sit in the world: auto (across the table, facing the robot), none, or "
            "X,Y,Z,YAW as for launch_ptomp.py."
        ),
    ] = "auto",
    min_demonstrations: Annotated[
        int, typer.Option(help="Tasks with fewer reaches are left out.", min=1)
    ] = 1,
    config: Annotated[
        Path | None, typer.Option(help="YAML file with parameters of PredictorConfig.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of the sample paths in the plot.")] = 0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results that --out already holds.")
    ] = False,
    smoke: Annotated[
        bool, typer.Option("--smoke", help=f"Use {_SMOKE_TRACKS} tracks a task only (seconds).")
    ] = False,
) -> None:
    """Learn a library of reaching tasks (one ProMP a task and side) from recordings."""
    console = Console()
    try:
        check_folder(out, _OUTPUTS, overwrite)
        settings = load_yaml(PredictorConfig, config) if config else PredictorConfig()
        settings = dataclasses.replace(settings, min_demonstrations=min_demonstrations)
        origin = results_origin()
        with ProgressLine(console) as progress:
            result = train_from_files(
                files,
                settings,
                group_by=task_from,
                place=place,
                leave_out_subject=leave_out_subject,
                leave_out_trial=leave_out_trial,
                max_tracks=_SMOKE_TRACKS if smoke else 0,
                progress=progress.say,
            )
            progress.say(f"writing {out}")
            write_results(result, out, seed, origin)
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(1) from error
    except OSError as error:
        print(f"error: cannot write to {out}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(1) from error
    table = Table(*_COLUMNS, title=f"{len(result.tasks)} tasks in {out / 'library.npz'}")
    for row in _rows(result):
        table.add_row(*row)
    console.print(table)
    console.print(result.library.placed, highlight=False, markup=False)
    for line_text in result.skipped[:5]:
        console.print(f"skipped: {line_text}", markup=False)
    if len(result.skipped) > 5:
        console.print(f"... and {len(result.skipped) - 5} more, all in results.json")


def train_main(argv: Sequence[str] | None = None) -> int:
    """Run ``train_promp`` with ``argv`` (default: the process' arguments).

    Returns:
        Exit code: 0 on success, 1 on unusable data or folders, 2 on wrong arguments.
    """
    try:
        app(args=None if argv is None else list(argv), prog_name="train_promp")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0
