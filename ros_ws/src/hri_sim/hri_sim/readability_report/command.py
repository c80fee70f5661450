"""Command line of ``scripts/reproduce_dmp.py``: tables and pictures of policies that people improve."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.policies.evaluation import finite
from hri_sim.policy_report.bars import as_json
from hri_sim.readability_report import improvement
from hri_sim.readability_report.bars import bars
from hri_sim.readability_report.cases import Case, chosen_cases
from hri_sim.readability_report.laboratory import Laboratory
from hri_sim.readability_report.learning import learn_missing
from hri_sim.readability_report.report import SECTIONS, report
from hri_sim.readability_report.run_folder import RunFolder, write_json

SEEDS, SMOKE_SEEDS = 24, 2
RESULTS = Path("docs/results")
RUNS, SMOKE_RUNS = Path("runs/dmp"), Path("runs/smoke_dmp")
FILE, TEXT = "dmp.json", "dmp.md"
FIGURES = "results.json"
"""The figures that others compare, alone: beside the report where it has a folder of its own."""
COMPARED = ("experiments", "rollout_ms_batch24", "imitation_rms_mm", "field_gradient_error")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def reproduce(
    cases: Sequence[Case],
    seeds: Sequence[int],
    folder: RunFolder,
    out: Path,
    *,
    workers: int,
    progress: ProgressLine,
) -> dict[str, Any]:
    """Let people take part who have not yet, measure, and write report, figures and pictures.

    Args:
        cases: Experiments.
        seeds: Of the people.
        folder: Of what is done.
        out: Of the report.
        workers: Processes.
        progress: Says how far it is.

    Returns:
        The content of ``dmp.json``.
    """
    origin = results_origin()
    learn_missing(cases, seeds, folder, workers=workers, progress=progress, origin=origin)
    laboratory = Laboratory(out, folder.smoke, progress)
    laboratory.take(folder, cases, seeds)
    sections = {one.name: finite(one.measure(laboratory)) for one in SECTIONS}
    parts = sections["parts"]
    content = {
        "origin": origin,
        "origins": laboratory.origins,
        "smoke": folder.smoke,
        "seeds": list(seeds),
        "bars": as_json(bars(sections)),
        "experiments": improvement.summary(sections["improvement"]),
        "rollout_ms_batch24": parts["rollouts"]["median_ms"],
        "imitation_rms_mm": max(one["max_mm"] for one in parts["imitation"].values()),
        "field_gradient_error": parts["field"]["error"],
        "sections": sections,
    }
    write_json(out / FILE, content)
    (out / TEXT).write_text(report(content))
    if out != RESULTS:
        write_json(out / FIGURES, {name: content[name] for name in COMPARED})
    return content


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_dmp(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for dmp.md, dmp.json, dmp/*.png and, elsewhere than in docs/results, "
            "results.json with the figures that others compare. Default: docs/results; smoke: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help="Folder of what is done, which is not done again. Default: runs/dmp; smoke: "
            "runs/smoke_dmp."
        ),
    ] = None,
    seeds: Annotated[
        int, typer.Option(help=f"Number of people; smoke: {SMOKE_SEEDS} at most.", min=1)
    ] = SEEDS,
    first_seed: Annotated[int, typer.Option(help="Seed of the first of them.", min=0)] = 0,
    experiments: Annotated[
        str,
        typer.Option(
            help="Experiments that are done, as transfer_a,transfer_b; of the others what is there "
            "already is in the report, too. Default: all."
        ),
    ] = "",
    workers: Workers = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two people, two updates, few readings (half a minute).")
    ] = False,
) -> None:
    """Do the experiments of the thesis' chapter 7 with simulated people, and make all tables and pictures.

    What was broken off goes on where it stopped; other seeds are added to those that are there.
    """
    console = Console()
    cases = chosen_cases(experiments)
    runs = runs or (SMOKE_RUNS if smoke else RUNS)
    out = out or (runs if smoke else RESULTS)
    make_folders(runs=runs, out=out)
    count = min(seeds, SMOKE_SEEDS) if smoke else seeds
    numbers = list(range(first_seed, first_seed + count))
    with resumable(console, runs), ProgressLine(console) as progress:
        content = reproduce(
            cases, numbers, RunFolder(runs, smoke), out, workers=workers or available_cores(),
            progress=progress,
        )  # fmt: skip
    for bar in content["bars"]:
        verdict = {True: "met", False: "missed", None: "not measured"}[bar["met"]]
        value = "–" if bar["measured"] is None else f"{bar['measured']:.3g} {bar['unit']}"
        console.print(
            f"{verdict:<12}  {bar['what']}: {value}, wanted {bar['wanted']:g} {bar['unit']}",
            highlight=False, markup=False, soft_wrap=True,
        )  # fmt: skip
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_dmp.py")
    return 0
