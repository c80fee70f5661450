"""Command line of ``scripts/benchmark_promp.py``: the ProMP core beside NumPy and movement_primitives."""

from __future__ import annotations

import itertools
import json
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.benchmarks import promp_cases as cases
from hri_prediction.benchmarks import promp_reference as reference
from hri_prediction.errors import HriError
from hri_prediction.results.folder import check_folder
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.warm import warm_kernels

OUTPUTS = ("results.json", "results.md")
TOLERANCE = 1e-8
"""Largest difference of means and covariances wanted, in metres and square metres."""

ROWS = (
    ("fit_ms", "fit, 8 weights x 3-D [ms]", "≤ 1"),
    ("fit_40_ms", "fit, 40 weights x 3-D [ms]", "–"),
    ("condition_us", "one sample, 40 x 3-D [µs]", "≤ 50"),
    ("mean_us", "mean path, 40 x 3-D [µs]", "–"),
    ("bank_us", "bank of hypotheses [µs]", "≤ 1000"),
    ("predictor_us", "whole predictor [µs]", "≤ 1000"),
)
"""Key in ``results.json``, what it is, and the bar for ours."""
NOTES = (
    "Medians. The implementations take turns step by step, so that what disturbs one disturbs all.",
    "Fit: 40 demonstrations of 200 samples. NumPy runs the same EM with the same prior. "
    "movement_primitives runs its own EM, without a prior and with another noise model, for at most as "
    "many iterations: its fit is compared by time, its regression of one demonstration by result.",
    "One sample: the filter conditions on one of 200 positions of a movement after the other. Mean "
    "path: at 200 phases.",
    "Bank: a sample of wrist and elbow in, the mixture over the next 1.5 s (31 points) out; 8 weights x "
    "6-D, 21 durations, four tasks and the unknown one, so 105 hypotheses. movement_primitives "
    "conditions each hypothesis by condition_position; likelihoods and the mixture, which it does not "
    "have, are those of NumPy.",
    "Whole predictor: input checks, segmentation, bank, and the arm of the prediction; there is "
    "nothing to compare it to.",
)
MISSING = "movement_primitives is not installed (requirements/dev.txt), so it is left out."

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def measure(seed: int, extent: cases.Extent, console: Console) -> dict[str, Any]:
    """All cases, each with random numbers of its own.

    Returns:
        Content of ``results.json`` without its origin.
    """
    others = reference.available()
    generators = np.random.default_rng(seed).spawn(6)
    with ProgressLine(console) as progress:
        progress.say("compiling kernels")
        warm_kernels()

        def begin(text: str, rounds: int) -> cases.Progress:
            progress.say(text)
            done = itertools.count(1)
            return lambda: progress.count(next(done), rounds + 1)

        tick = begin("fit", extent.fit)
        fit = cases.fit_case(generators[0], cases.FIT_WEIGHTS, extent, others, tick)
        tick = begin("fit, 40 weights", extent.fit)
        large = cases.fit_case(generators[1], cases.STEP_WEIGHTS, extent, others, tick)
        tick = begin("conditioning", extent.stream)
        step = cases.condition_case(generators[2], extent, others, tick)
        tick = begin("mean path", extent.stream)
        mean = cases.mean_case(generators[3], extent, others, tick)
        tick = begin("bank", extent.reaches)
        library = cases.draw_library(generators[4])
        bank = cases.bank_case(generators[5], library, extent, others, tick)
        tick = begin("predictor", extent.reaches)
        whole = cases.predictor_case(generators[5], library, extent, tick)
    differences = {
        key: value for case in (fit, step, mean, bank) for key, value in case.differences.items()
    }
    for key, value in large.differences.items():
        differences[key] = max(value, differences[key])
    taken = {
        "fit_ms": (fit, 1e3),
        "fit_40_ms": (large, 1e3),
        "condition_us": (step, 1e6),
        "mean_us": (mean, 1e6),
        "bank_us": (bank, 1e6),
        "predictor_us": (whole, 1e6),
    }
    return {
        **{key: _statistic(case, scale, 50.0) for key, (case, scale) in taken.items()},
        "max_difference": max(differences.values()),
        "differences": differences,
        "p95": {key: _statistic(case, scale, 95.0) for key, (case, scale) in taken.items()},
        "samples": {key: case.times[cases.OURS].size for key, (case, _) in taken.items()},
        "seed": seed,
        "left_out": [] if others else [MISSING],
    }


def _statistic(case: cases.Case, scale: float, percentile: float) -> dict[str, float | None]:
    return {
        name: float(np.percentile(case.times[name], percentile)) * scale
        if name in case.times
        else None
        for name in cases.NAMES
    }


def table_rows(results: dict[str, Any]) -> list[tuple[str, ...]]:
    """Figures as (what, ours, NumPy, its ratio, movement_primitives, its ratio, wanted)."""

    def ratio(own: float, other: float | None) -> str:
        return "–" if other is None else f"{other / own:.1f}"

    def figure(value: float | None) -> str:
        return "–" if value is None else f"{value:.3g}" if value < 1000 else f"{value:.0f}"

    found: list[tuple[str, ...]] = []
    for key, label, wanted in ROWS:
        own, plain, theirs = (results[key][name] for name in cases.NAMES)
        found.append(
            (label, figure(own), figure(plain), ratio(own, plain), figure(theirs),
             ratio(own, theirs), wanted)
        )  # fmt: skip
    return found


COLUMNS = ("what", "ours", "NumPy", "÷ ours", "movement_primitives", "÷ ours", "wanted")


def write_results(out: Path, results: dict[str, Any]) -> None:
    """``results.json`` and ``results.md``."""
    (out / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    smoke = " --smoke" if results["smoke"] else ""
    lines = [
        "# ProMP core, measured",
        "",
        f"Made by `scripts/benchmark_promp.py --seed {results['seed']}{smoke}`.",
        "",
        origin_line(results["origin"]),
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + " --- |" * len(COLUMNS),
        *("| " + " | ".join(row) + " |" for row in table_rows(results)),
        "",
        f"Largest difference of means and covariances where the models coincide: "
        f"{results['max_difference']:.1e} (wanted ≤ {TOLERANCE:.0e}).",
        "",
        *(f"- {note}" for note in (*NOTES, *results["left_out"])),
        "",
        "| compared | largest difference |",
        "| --- | --- |",
        *(f"| {key} | {value:.1e} |" for key, value in results["differences"].items()),
        "",
    ]
    (out / "results.md").write_text("\n".join(lines))


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def benchmark(
    out: Annotated[Path, typer.Option(help="Folder for results.json and results.md.")],
    seed: Annotated[int, typer.Option(help="Seed of the movements that are drawn.", min=0)] = 0,
    smoke: Annotated[bool, typer.Option("--smoke", help="Few repetitions: for CI.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results that --out already holds.")
    ] = False,
) -> None:
    """Time the ProMP core beside plain NumPy and movement_primitives, and compare their results.

    Takes about a minute. Let nothing else run meanwhile. Exits with 3 when results differ by more than
    rounding explains.
    """
    console = Console()
    try:
        check_folder(out, OUTPUTS, overwrite)
        out.mkdir(parents=True, exist_ok=True)  # what cannot be made is said before the measurement
        origin = results_origin()
        results = measure(seed, cases.SMOKE if smoke else cases.Extent(), console)
        results |= {"smoke": smoke, "origin": origin}
        write_results(out, results)
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(1) from error
    except OSError as error:
        print(f"error: cannot write to {out}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(1) from error
    table = Table(*(name.replace("_", " ") for name in COLUMNS))
    for row in table_rows(results):
        table.add_row(*(escape(cell) for cell in row))
    console.print(table)
    for note in results["left_out"]:
        console.print(note, highlight=False)
    worst = results["max_difference"]
    console.print(f"largest difference: {worst:.1e} (wanted ≤ {TOLERANCE:.0e})", highlight=False)
    console.print(f"results: {out / 'results.json'}", highlight=False, soft_wrap=True)
    if worst > TOLERANCE:
        raise typer.Exit(3)


def main(argv: list[str] | None = None) -> int:
    """Run with ``argv`` (default: the process' arguments); its exit code."""
    try:
        app(args=argv, prog_name="benchmark_promp.py")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0
