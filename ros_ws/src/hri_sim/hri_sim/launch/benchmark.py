"""Command line of ``scripts/benchmark_graph.py``: latency, rates, losses and load of the live graph."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Annotated, Any

import matplotlib
import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.errors import GraphError, HriError
from hri_prediction.results.origin import origin_line, results_origin, socket_line
from hri_sim.launch.folder import NewFolder
from hri_sim.launch.run import RunOptions, RunResult, run_graph
from hri_sim.launch.summary import late_replans, percentiles
from hri_sim.launch.telling import explain
from hri_sim.recording.benchmark import benchmark_recorder
from hri_sim.scenario.shipped import load_shipped
from hri_sim.simulator.benchmark import measure_speed

CORES = 2
"""The bars are stated for two cores: ``cpu_share`` is the share of two, however many there are."""
RECORDER_RATES_HZ = (5_000.0, 10_000.0)

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def measure(
    seeds: list[int], folder: Path, console: Console, *, reaches: int, seconds: float
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Run the graph once a seed and pool the figures.

    Args:
        seeds: One run each.
        folder: Gets the runs.
        console: Shows progress.
        reaches: Reaches of a run.
        seconds: Duration of each measurement of recorder and simulator [s].

    Raises:
        GraphError: when no run went well.

    Returns:
        Content of ``results.json``, and the pooled latencies [ms] by name. Runs that failed, or whose
        recorder died, are named as ``failures`` with the reason: figures of the others alone may flatter.
    """
    runs: list[RunResult] = []
    failures: dict[int, str] = {}
    for seed in seeds:
        console.print(f"graph, seed {seed}", highlight=False)
        options = RunOptions(out=folder / f"seed_{seed}", seed=seed, reaches=reaches)
        try:
            run = run_graph(options, console)
        except HriError as error:
            explain(error, console)
            failures[seed] = str(error)
            continue
        if any(reach["goal_error_m"] is None for reach in run.summary["reaches"]):
            failures[seed] = "the recorder died"
        else:
            runs.append(run)
    if not runs:
        raise GraphError("no run went well", hint="see the errors above")
    console.print("recorder", highlight=False)
    recorder = 0.0
    for rate in RECORDER_RATES_HZ:
        result = benchmark_recorder(rate, seconds)
        if result.lost == 0:
            recorder = max(recorder, result.sent_rate_hz)
    console.print("simulator", highlight=False)
    speed = measure_speed(load_shipped("table_reach"), seconds)
    recorded = [run.series for run in runs if run.series is not None]
    latencies = {
        "mocap_to_prediction": np.concatenate([s.mocap_to_prediction_ms for s in recorded]),
        "mocap_to_trajectory": np.concatenate([s.mocap_to_trajectory_ms for s in recorded]),
    }
    topics = sorted({topic for series in recorded for topic in series.rates_hz})
    reaches_done = [reach for run in runs for reach in run.summary["reaches"]]
    misses, planned = late_replans(reaches_done)
    results = {
        "latency_ms": {name: percentiles(values) for name, values in latencies.items()},
        "rates_hz": {
            topic: float(np.median([series.rates_hz.get(topic, 0.0) for series in recorded]))
            for topic in topics
        },
        "lost_messages": sum(series.lost_messages for series in recorded),
        "host_share": float(np.median([run.summary["host_share"] for run in runs])),
        "cpu_share": float(np.median([run.cpu_cores / CORES for run in runs])),
        "replan_miss_share": misses / max(planned, 1),
        "replans": planned,
        "recorder_msgs_per_s": recorder,
        "sim_realtime_factor": speed.realtime_factor,
        "seeds": seeds,
        "outcomes": [run.summary["outcome"] for run in runs],
        "failures": failures,
    }
    return results, latencies


ROWS = (
    ("mocap → prediction, p50 / p99 [ms]", "mocap_to_prediction", "–"),
    ("mocap → trajectory, p50 / p99 [ms]", "mocap_to_trajectory", "≤ 60 / ≤ 80"),
)


def rows(results: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Figures as (what, measured, wanted)."""
    found = []
    for label, key, wanted in ROWS:
        p50, p99 = results["latency_ms"][key]["p50"], results["latency_ms"][key]["p99"]
        found.append((label, "–" if p50 is None else f"{p50:.1f} / {p99:.1f}", wanted))
    for topic, wanted in (
        ("/humans/bodies/person1/arm", "250"),
        ("/joint_states", "250"),
        ("/humans/bodies/person1/prediction", "≥ 25"),
    ):
        found.append((f"{topic} [Hz]", f"{results['rates_hz'].get(topic, 0.0):.1f}", wanted))
    lacking = "messages that bags lack (topics of one publisher)"
    found.append((lacking, str(results["lost_messages"]), "0"))
    found.append(("share of two cores", f"{results['cpu_share'] * 100:.0f} %", "≤ 75 %"))
    # No bar: who runs it cannot do anything about it, but what is late is late by it.
    taken = f"{results['host_share'] * 100:.1f} %"
    found.append(("processor time that the host took", taken, "–"))
    # A miss is an interval without a new plan: dropped as late, failed, or not even begun.
    missed = f"{results['replan_miss_share'] * 100:.2f} % of {results['replans']}"
    found.append(("intervals without a new plan", missed, "< 0.5 %"))
    found.append(("recorder without loss [1/s]", f"{results['recorder_msgs_per_s']:.0f}", "≥ 5000"))
    found.append(("simulator alone, × real time", f"{results['sim_realtime_factor']:.1f}", "≥ 20"))
    return found


def write_results(out: Path, results: dict[str, Any], latencies: dict[str, np.ndarray]) -> None:
    """``results.json``, ``results.md`` and ``latency.png``."""
    (out / "results.json").write_text(json.dumps(results, indent=2, allow_nan=False) + "\n")
    lines = [
        "# The live graph, measured",
        "",
        f"Made by `scripts/benchmark_graph.py`, seeds {', '.join(map(str, results['seeds']))}; "
        f"outcomes: {', '.join(results['outcomes'])}. Latency counts from the capture of the newest "
        "sample that was used; the simulated sensor delay is not counted.",
        "",
        f"{origin_line(results['origin'])} {socket_line(results['origin'])}",
        "",
        *(
            f"Seed {seed} is not counted: {cause}.\n"
            for seed, cause in results.get("failures", {}).items()
        ),
        "| what | measured | wanted |",
        "| --- | --- | --- |",
        *(f"| {what} | {measured} | {wanted} |" for what, measured, wanted in rows(results)),
        "",
    ]
    (out / "results.md").write_text("\n".join(lines))
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 3.2), layout="constrained")
    for (name, values), colour in zip(latencies.items(), ("#0072B2", "#D55E00"), strict=True):
        axes.hist(values, bins=np.arange(0, 101, 2), histtype="stepfilled", alpha=0.6,
                  color=colour, label=name.replace("_", " "))  # fmt: skip
    axes.axvline(80, color="0.3", linestyle="--", linewidth=1)
    axes.text(80, axes.get_ylim()[1] * 0.95, " p99 wanted", va="top", fontsize=8, color="0.3")
    axes.set(xlabel="latency [ms]", ylabel="messages", title="Age of the newest sample used")
    axes.legend(frameon=False)
    figure.savefig(out / "latency.png", dpi=130)
    plt.close(figure)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def benchmark(
    out: Annotated[Path, typer.Option(help="Folder for results and runs; new or empty.")],
    seeds: Annotated[int, typer.Option(help="Number of runs, one a seed.", min=1)] = 5,
    first_seed: Annotated[int, typer.Option(help="First seed.", min=0)] = 200,
    smoke: Annotated[bool, typer.Option(help="One reach, short measurements: for CI.")] = False,
) -> None:
    """Measure the live graph: every node its own process, in real time.

    Writes results.json, results.md and latency.png. Let nothing else run meanwhile: the graph takes
    what two cores have.
    """
    console = Console()
    try:
        NewFolder(out, "--out")
        origin = results_origin()
        with tempfile.TemporaryDirectory(dir=out) as scratch:
            results, latencies = measure(
                list(range(first_seed, first_seed + (1 if smoke else seeds))),
                Path(scratch),
                console,
                reaches=1 if smoke else 3,
                seconds=1.0 if smoke else 5.0,
            )
    except HriError as error:
        explain(error, console)
        raise typer.Exit(1) from error
    results["origin"] = origin
    write_results(out, results, latencies)
    table = Table()
    for name in ("what", "measured", "wanted"):
        table.add_column(name)
    for row in rows(results):
        table.add_row(*(escape(cell) for cell in row))
    console.print(table)
    console.print(f"results: {out / 'results.json'}", highlight=False)
    if results["failures"]:
        console.print(f"{len(results['failures'])} of {len(results['seeds'])} runs failed")
        raise typer.Exit(1)


def main() -> int:
    """Entry point."""
    app(prog_name="benchmark_graph.py")
    return 0
