"""Command line of ``scripts/benchmark_kernel.py``: the planner's kernel beside others."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from hri_planner.benchmarks import kernel_cases as cases
from hri_planner.warm import warm_kernels
from hri_prediction.benchmarks.promp_cases import Case
from hri_prediction.benchmarks.promp_cases import Progress as Tick
from hri_prediction.errors import HriError
from hri_prediction.results.folder import check_folder
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.warm import warm_kernels as warm_prediction_kernels

OUTPUTS = ("results.json", "results.md")
TOLERANCE = 1e-9
"""Largest difference wanted in double precision: metres, or share of a cost term."""
TOLERANCE_SINGLE = 1e-4
"""The same in single precision."""
WANTED_CONFIG, WANTED_ITERATION = 60, 20  # times as fast as NumPy
WANTED_ROLLOUTS, WANTED_FORECAST_MS = 200_000, 2
NAMES = {
    cases.DOUBLE: "ours, float64", cases.SINGLE: "ours, float32", cases.NUMPY: "NumPy",
    cases.ROWS: "NumPy, coordinate by coordinate", cases.PINOCCHIO: "loop over Pinocchio and coal",
    cases.TORCH: "PyTorch", cases.OURS: "ours, float64",
}  # fmt: skip
NOTES = (
    "One core. Medians, and ratios of them; the implementations take turns, so that what disturbs one "
    "disturbs all. The fastest turn of each stands beside: on a busy machine a long turn is interrupted "
    "more often than a short one, so there the ratio of the fastest turns says more.",
    "Configuration: forward kinematics and the nine distances between the robot's three capsules and the "
    "arm's three, for all columns of 30 roll-outs of 42 steps (1350 configurations a call). Ours also "
    "computes what the planner makes of them (collision, contact, smallest distance).",
    "NumPy: rotation matrices and points, as one writes it, all configurations in one call. Coordinate by "
    "coordinate: the same by hand in closed formulas, every coordinate an array of its own, no small axis; "
    "this is how NumPy is fastest. Neither loops over configurations. Memory that NumPy frees stays with "
    "the process, or it would be slower by a factor that depends on what ran before.",
    "Pinocchio's geometry model holds all capsules; only the loop over configurations is Python.",
    "Iteration: noise, costs of 30 roll-outs, their average and its cost, acceptance. NumPy uses the "
    "distances that are fastest in it. Ours is called as by the planner, ten iterations at a time.",
    "Forecast: one sample of motion capture in, all hypotheses of task and duration conditioned, the "
    "planner's cost model bound to the forecast.",
)
MISSING = {
    cases.PINOCCHIO: "Pinocchio or coal is not installed (requirements/dev.txt), so they are left out.",
    cases.TORCH: "PyTorch is not installed, so it is left out.",
}

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def measure(seed: int, extent: cases.Extent, console: Console) -> dict[str, Any]:
    """All cases, each with random numbers of its own.

    Returns:
        Content of ``results.json`` without its origin.
    """
    generators = np.random.default_rng(seed).spawn(3)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        line = progress.add_task("compiling kernels", total=None)
        warm_prediction_kernels()
        warm_kernels()

        def begin(text: str, rounds: int) -> Tick:
            progress.reset(line, total=rounds + 1, description=text)
            return lambda: progress.advance(line)

        cases.keep_freed_memory()
        scene = cases.draw_scene(generators[0])
        tick = begin("distances", extent.rounds)
        clearance = cases.clearance_case(scene, extent, tick)
        tick = begin("iteration", extent.rounds)
        iteration = cases.iteration_case(generators[1], scene, extent, tick)
        tick = begin("forecast", extent.reaches)
        forecast = cases.forecast_case(generators[2], scene, extent, tick)
    config_ns, iteration_us = _medians(clearance, 1e9), _medians(iteration, 1e6)
    rollouts = len(scene.rollouts)
    return {
        "config_ns": config_ns,
        "iteration_us": iteration_us,
        "rollouts_per_s": 1e6 * rollouts / iteration_us[cases.OURS],
        "forecast_ms": _medians(forecast, 1e3)[cases.OURS],
        "ratios": {
            "config": _ratios(config_ns, cases.DOUBLE),
            "config_f32": _ratios(config_ns, cases.SINGLE),
            "iteration": _ratios(iteration_us, cases.OURS),
        },
        "fastest": {
            "config_ns": _fastest(clearance, 1e9),
            "iteration_us": _fastest(iteration, 1e6),
            "forecast_ms": _fastest(forecast, 1e3)[cases.OURS],
        },
        "differences": {**clearance.differences, **iteration.differences},
        "configurations": rollouts * len(scene.times_s),
        "rounds": extent.rounds,
        "seed": seed,
        "left_out": [text for name, text in MISSING.items() if name not in config_ns],
    }


def _medians(case: Case, scale: float) -> dict[str, float]:
    return {name: float(np.median(times)) * scale for name, times in case.times.items()}


def _fastest(case: Case, scale: float) -> dict[str, float]:
    return {name: float(np.min(times)) * scale for name, times in case.times.items()}


def _ratios(figures: dict[str, float], own: str) -> dict[str, float]:
    ours = (cases.DOUBLE, cases.SINGLE, cases.OURS)
    return {name: value / figures[own] for name, value in figures.items() if name not in ours}


COLUMNS = ("what", "median", "fastest", "÷ ours, float64", "÷ ours, float32")


def table_rows(results: dict[str, Any]) -> list[tuple[str, ...]]:
    """Figures as (what, median, fastest, ratio to ours in double and in single precision)."""
    rows = []
    for key, label, own in (
        ("config_ns", "configuration, {} [ns]", cases.DOUBLE),
        ("iteration_us", "iteration, {} [µs]", cases.OURS),
    ):
        figures = results[key]
        for name, value in figures.items():
            others = (value / figures[reference] for reference in (own, cases.SINGLE))
            low = results["fastest"][key][name]
            rows.append(
                (label.format(NAMES[name]), _figure(value), _figure(low), *map(_figure, others))
            )
    rows.append(("roll-outs [1/s]", f"{results['rollouts_per_s']:.0f}", "–", "–", "–"))
    low = results["fastest"]["forecast_ms"]
    rows.append(("forecast [ms]", _figure(results["forecast_ms"]), _figure(low), "–", "–"))
    return rows


def _figure(value: float) -> str:
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def wanted_lines(results: dict[str, Any]) -> list[str]:
    """What is wanted, beside what was found."""
    lines = []
    for key, own, name, bar, text in (
        ("config_ns", cases.DOUBLE, cases.NUMPY, WANTED_CONFIG, "configuration, NumPy ÷ ours"),
        ("config_ns", cases.SINGLE, cases.NUMPY, WANTED_CONFIG, "the same, ours in float32"),
        (
            "config_ns",
            cases.DOUBLE,
            cases.ROWS,
            WANTED_CONFIG,
            "NumPy coordinate by coordinate ÷ ours",
        ),
        ("iteration_us", cases.OURS, cases.NUMPY, WANTED_ITERATION, "iteration, NumPy ÷ ours"),
    ):
        ratio, least = (
            figures[name] / figures[own] for figures in (results[key], results["fastest"][key])
        )
        lines.append(
            f"{text}: {_figure(ratio)}, of the fastest turns {_figure(least)} (wanted ≥ {bar})"
        )
    lines.append(f"roll-outs/s: {results['rollouts_per_s']:.0f} (wanted ≥ {WANTED_ROLLOUTS})")
    return [
        *lines,
        f"forecast: {_figure(results['forecast_ms'])} ms (wanted ≤ {WANTED_FORECAST_MS})",
    ]


def too_far_apart(results: dict[str, Any]) -> list[str]:
    """Comparisons whose difference rounding does not explain."""
    return [
        f"{key}: {value:.1e}"
        for key, value in results["differences"].items()
        if value > (TOLERANCE_SINGLE if cases.SINGLE in key else TOLERANCE)
    ]


def write_results(out: Path, results: dict[str, Any]) -> None:
    """``results.json`` and ``results.md``."""
    (out / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    smoke = " --smoke" if results["smoke"] else ""
    lines = [
        "# The planner's kernel, measured",
        "",
        f"Made by `scripts/benchmark_kernel.py --seed {results['seed']}{smoke}`.",
        "",
        origin_line(results["origin"]),
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + " --- |" * len(COLUMNS),
        *("| " + " | ".join(row) + " |" for row in table_rows(results)),
        "",
        "Wanted, and found:",
        "",
        *(f"- {line}" for line in wanted_lines(results)),
        "",
        "How:",
        "",
        *(f"- {note}" for note in (*NOTES, *results["left_out"])),
        "",
        f"| compared (wanted ≤ {TOLERANCE:.0e}, float32 ≤ {TOLERANCE_SINGLE:.0e}) | largest difference |",
        "| --- | --- |",
        *(f"| {key} | {value:.1e} |" for key, value in results["differences"].items()),
        "",
    ]
    (out / "results.md").write_text("\n".join(lines))


@app.command()
def benchmark(
    out: Annotated[Path, typer.Option(help="Folder for results.json and results.md.")],
    seed: Annotated[int, typer.Option(help="Seed of scene and noise.", min=0)] = 0,
    smoke: Annotated[bool, typer.Option("--smoke", help="Few repetitions: for CI.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results that --out already holds.")
    ] = False,
) -> None:
    """Time the planner's kernel beside NumPy, Pinocchio and PyTorch, and compare what they compute.

    Takes about half a minute. Let nothing else run meanwhile. Exits with 3 when results differ by more
    than rounding explains.
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
    table = Table(*COLUMNS)
    for row in table_rows(results):
        table.add_row(*(escape(cell) for cell in row))
    console.print(table)
    for line in (*wanted_lines(results), *results["left_out"]):
        console.print(line, highlight=False)
    console.print(f"results: {out / 'results.json'}", highlight=False, soft_wrap=True)
    wrong = too_far_apart(results)
    if wrong:
        print(f"error: results differ: {'; '.join(wrong)}", file=sys.stderr)
        raise typer.Exit(3)


def main(argv: list[str] | None = None) -> int:
    """Run with ``argv`` (default: the process' arguments); its exit code."""
    try:
        app(args=argv, prog_name="benchmark_kernel.py")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0
