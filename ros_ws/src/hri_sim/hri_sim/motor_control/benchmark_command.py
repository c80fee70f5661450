"""Command line of ``scripts/benchmark_ocp.py``: optimal control of reaching and its inverse, measured."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.errors import HriError
from hri_prediction.motor_control.batch import prepare
from hri_prediction.motor_control.convention import YAW_PITCH
from hri_prediction.results.folder import check_folder
from hri_prediction.results.kept import kept
from hri_prediction.results.options import make_folders, resumable
from hri_prediction.results.origin import origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.motor_control import benchmark_cases as cases

OUTPUTS = ("results.json", "results.md")
PARTS = ".benchmark_parts"
"""Folder, within that of results, of what is measured until all is."""
WORK, PACKAGES = "hri_sim.motor_control.benchmark_cases", ("numpy", "scipy", "numba", "casadi")
"""What decides about results."""
HEAD = ("what", "measured", "wanted", "verdict")
MET, MISSED = "met", "missed"
NOTES = (
    "Optimal control: the 81 reaches of the thesis' chapter 2, five random mixes of hand jerk, joint jerk, "
    "torque change, geodesic and energy each (uniform on the simplex), from the motion of least joint jerk "
    "on. Multiple shooting: CasADi with IPOPT, equations of motion of its own, N = 30, one solve after "
    "ours each time; the time that it takes to build the program is not counted. The gap is the largest "
    "over the ends of its intervals. Spread: of the cost, by the cost, from starts with 0.3 rad of noise "
    "on all coefficients of the motion of least joint jerk, three for each solve.",
    "Inverse, without noise: random reaches of the design, weights of four costs, all at least 0.03. "
    "Solves count those for scaling and for each cost alone. The search is COBYQA from three radii. Where "
    "no optimum is found for what was drawn, it is drawn anew.",
    "People: simulated, each with an arm, a pace, postures and a law of weights of their own; three "
    "repetitions of each reach with 3 mm of noise on each coordinate of each keypoint, seen as recordings "
    "are: angles of the model that come nearest, smoothed, cut at 5 % of the peak speed, averaged. Mixes "
    "and single costs are compared for the first of them; laws are fitted to each of the first three.",
)


def bars(results: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """What is measured beside what is wanted."""
    ocp, inverse = results["ocp"], results["ioc"]
    batch, mixed, law = results["batch"], results["composite"], results["law"]

    def row(what: str, measured: str, wanted: str, met: bool) -> tuple[str, str, str, str]:
        return what, measured, wanted, MET if met else MISSED

    return [
        row(
            "new process, nothing compiled yet: until the first optimum [s]",
            f"{ocp['build_seconds']:.0f}",
            "≤ 60",
            ocp["build_seconds"] <= 60.0,
        ),
        row(
            "reaches solved",
            f"{ocp['converged']} of {ocp['n']}",
            "all",
            ocp["converged"] == ocp["n"],
        ),
        row("one solve, median [ms]", f"{ocp['median_ms']:.1f}", "≤ 10", ocp["median_ms"] <= 10.0),
        row(
            "multiple shooting takes so many times as long",
            f"{ocp['speedup_vs_multiple_shooting']:.0f}",
            "≥ 50",
            ocp["speedup_vs_multiple_shooting"] >= 50.0,
        ),
        row(
            f"hand apart from multiple shooting, largest of {ocp['multiple_shooting_converged']} [cm]",
            f"{ocp['max_hand_gap_cm']:.4f}",
            "≤ 0.05",
            ocp["max_hand_gap_cm"] <= 0.05,
        ),
        row(
            f"spread of the cost between {ocp['starts_n']} other starts",
            f"{ocp['multistart_spread']:.0e}",
            "< 1e-6",
            ocp["multistart_spread"] < 1e-6,
        ),
        row(
            "weights found to 1e-3, no noise",
            f"{100 * inverse['share_below_1e3']:.0f} %",
            "≥ 95 %",
            inverse["share_below_1e3"] >= 0.95,
        ),
        row(
            "solves for one reach, median",
            f"{inverse['solves_median']:.0f}",
            "≤ 25",
            inverse["solves_median"] <= 25,
        ),
        row(
            "seconds for one reach, median",
            f"{inverse['seconds_median']:.2f}",
            "≤ 0.3",
            inverse["seconds_median"] <= 0.3,
        ),
        row(
            "no farther from what was seen than a search without derivatives",
            f"{100 * inverse['dtw_not_worse_share']:.0f} %",
            "≥ 95 %",
            inverse["dtw_not_worse_share"] >= 0.95,
        ),
        row(
            f"{batch['n']} reaches on one core [min]",
            f"{batch['seconds'] / 60.0:.1f}, {batch['failed']} not explained",
            "≤ 10, all",
            batch["seconds"] <= 600.0 and not batch["failed"],
        ),
        row(
            "mix no farther than the best single cost",
            f"{mixed['not_worse']} of {mixed['n']}",
            "all",
            mixed["not_worse"] == mixed["n"],
        ),
        row(
            "mix, mean distance [cm]",
            f"{mixed['mean_dtw_cm']:.3f}",
            "≤ 0.2",
            mixed["mean_dtw_cm"] <= 0.2,
        ),
        row(
            "the same by that of the best single cost",
            f"{mixed['ratio_best_single']:.2f}",
            "≤ 0.4",
            mixed["ratio_best_single"] <= 0.4,
        ),
        row(
            f"laws of {law['people']} people, reaches from rest to rest, least R² to the truth",
            f"{law['r2_truth']:.3f}",
            "≥ 0.95",
            law["r2_truth"] >= 0.95,
        ),
    ]


def measure(seed: int, extent: cases.Extent, parts: Path, progress: ProgressLine) -> dict[str, Any]:
    """All parts, each with random numbers of its own.

    Args:
        seed: Of these.
        extent: How much is measured.
        parts: Folder of what is done, which is not done again.
        progress: Says how far it is.
    """
    generators = np.random.default_rng(seed).spawn(3)
    progress.say("compiling the model of the arm")
    prepare([YAW_PITCH.name])

    def keep(name: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        return kept(parts, WORK, PACKAGES, repr((name, seed, extent)), make)

    progress.say("optimal control")
    ocp = keep("ocp", lambda: cases.ocp_case(extent, generators[0], progress.count))
    progress.say("inverse optimal control")
    inverse = keep("ioc", lambda: cases.inverse_case(extent, generators[1], progress.count))
    people = keep(
        "people", lambda: cases.people_case(extent, generators[2], progress.count, progress.say)
    )
    return {"ocp": ocp, "ioc": inverse, **people}


def report(results: dict[str, Any]) -> str:
    """The text of ``results.md``."""
    smoke = " --smoke" if results["smoke"] else ""
    missing = results["law"]["known"]["n"] - results["law"]["n"]
    new = results["ocp"]["new_process"]
    each_law = ", ".join(f"{value:.3f}" for value in results["law"]["r2_of_each"])
    free, seen = (results["ioc"]["cut"][f"accelerations_{each}"] for each in ("free", "seen"))
    text = [
        "# Optimal control of reaching and its inverse, measured\n",
        f"Made by `scripts/benchmark_ocp.py --seed {results['seed']}{smoke}`.\n",
        f"{origin_line(results['origin'])}\n",
        "| " + " | ".join(HEAD) + " |",
        "|" + " --- |" * len(HEAD),
        *("| " + " | ".join(row) + " |" for row in bars(results)),
        "",
        f"With its scale factors, which are optima of the same reach, a solve takes "
        f"{results['ocp']['whole_median_ms']:.1f} ms (median). In a new process, once the model is "
        f"compiled, the first one comes {new['first_s']:.2f} s after {new['import_s']:.1f} s of imports "
        "(where this checkout had not used kernels before, they are compiled meanwhile), "
        f"another after {new['next_ms']:.1f} ms more.",
        "",
        f"Multiple shooting takes {results['ocp']['multiple_shooting_median_ms'] / 1e3:.1f} s (median; "
        f"{results['ocp']['multiple_shooting_converged']} of {results['ocp']['multiple_shooting_n']} "
        "solves converged), a search without derivatives "
        f"{results['ioc']['search_solves_median']:.0f} solves. The weights of one noisy reach are off by "
        f"{results['composite']['alpha_error_median']:.2f} (median of the largest errors). Of the "
        f"variance of the true ones they explain {results['law']['r2_single_reaches']:.2f} at least (below "
        f"0: less than their mean would), and {results['law']['r2_single_whole']:.2f} at least where each "
        "is explained as a whole that begins and ends where its speed says so. Laws of "
        f"{results['law']['people']} people, of {results['law']['n']} "
        f"paths, explain {each_law} of it (pooled {results['law']['r2_pooled']:.3f}) where reaches are "
        "whole, from rest to rest, repetitions share their weights but each has ends and a duration of its "
        "own, and when each began and ended, which "
        f"no recording tells well enough, is found along with the law ({missing} more were not found in "
        "the noise, or no rest beside them); "
        f"{results['law']['known']['r2_truth']:.3f} at least were it known, "
        f"{results['law']['means']['r2_truth']:.3f} at least where, besides, the mean path of the "
        f"repetitions is explained instead, and {results['law']['cut']['r2_truth']:.2f} at least of paths "
        "that were cut at 5 % of their peak speed.",
        "",
        f"Without noise {results['ioc']['not_explained']} of {results['ioc']['n']} reaches were not "
        f"explained (their error counts as 1), {results['ioc']['search_n']} were by the search too. "
        f"Cut as reaches of recordings are ({results['ioc']['cut']['n']} reaches), weights are off by "
        f"{free['alpha_error_median']:.3f}, and the optimum is {free['distance_cm_median']:.3f} cm from "
        "what was seen, where accelerations at the cuts are left to the optimum, as they are of "
        f"recordings; by {seen['alpha_error_median']:.3f} and {seen['distance_cm_median']:.4f} cm where "
        "they are known (medians).",
        "",
        *(f"- {note}" for note in NOTES),
        "",
    ]
    return "\n".join(text)


app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def benchmark(
    out: Annotated[Path, typer.Option(help="Folder for results.json and results.md.")],
    seed: Annotated[int, typer.Option(help="Seed of reaches, weights and people.", min=0)] = 0,
    smoke: Annotated[bool, typer.Option("--smoke", help="A few of each: for CI.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the results that --out already holds.")
    ] = False,
) -> None:
    """Measure optimal control of reaching beside multiple shooting, and its inverse beside a search.

    Takes a while of one core, and goes on with the next of its three parts where it was
    stopped. Let nothing else run meanwhile. Exit code 0: every bar is met; 3: one is missed (of a smoke
    run: 0, whatever it measures).
    """
    console = Console()
    parts = out / PARTS
    try:
        check_folder(out, OUTPUTS, overwrite)
        make_folders(out=out, parts=parts)
        origin = results_origin()
        with resumable(console, parts), ProgressLine(console) as progress:
            results = measure(seed, cases.SMOKE if smoke else cases.Extent(), parts, progress)
        results |= {"seed": seed, "smoke": smoke, "origin": origin}
        (out / OUTPUTS[0]).write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
        (out / OUTPUTS[1]).write_text(report(results))
        shutil.rmtree(parts)  # done: what is asked for again is measured again
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(1) from error
    except OSError as error:
        print(f"error: cannot write to {out}: {error.strerror or error}", file=sys.stderr)
        raise typer.Exit(1) from error
    table = Table(*map(escape, HEAD))
    found = bars(results)
    for row in found:
        table.add_row(*row)
    console.print(table)
    console.print(f"results: {out / OUTPUTS[1]}", highlight=False, soft_wrap=True)
    if not smoke and any(row[-1] == MISSED for row in found):
        raise typer.Exit(3)


def main(argv: list[str] | None = None) -> int:
    """Run with ``argv`` (default: the process' arguments); its exit code."""
    try:
        app(args=argv, prog_name="benchmark_ocp.py")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0
