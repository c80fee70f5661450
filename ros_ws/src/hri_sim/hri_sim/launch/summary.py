"""What a run comes to: figures for the table and for ``summary.json``."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hri_planner.robot.model import load_robot
from hri_sim.launch.conductor import ReachReport
from hri_sim.launch.record import Series

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ReachFigures:
    """Figures of one reach; see :func:`summarise`."""

    outcome: str
    reason: str
    goal_error_m: float | None
    min_clearance_m: float | None
    duration_s: float
    replans: int
    deadline_misses: int
    max_handover_jump_rad: float
    baseline_min_clearance_m: float | None


def percentiles(values: FloatArray) -> dict[str, float | None]:
    """Median and 99th percentile; none of an empty array."""
    if not len(values):
        return {"p50": None, "p99": None}
    return {"p50": float(np.percentile(values, 50)), "p99": float(np.percentile(values, 99))}


def _least(values: FloatArray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else None


def reach_figures(series: Series, reports: list[ReachReport]) -> list[ReachFigures]:
    """Figures of each reach; a reach lasts from its cue to the next one's, the rest included."""
    marks = series.record.reaches
    found = []
    for number, (report, mark) in enumerate(zip(reports, marks, strict=True)):
        end = marks[number + 1].start_s if number + 1 < len(marks) else np.inf

        def during(times: FloatArray, begin: float = mark.start_s, until: float = end) -> Any:
            return (times >= begin) & (times < until)

        # A recorder that died left no witness: then nothing is said, rather than what it last saw.
        whole = bool(series.record.time_s[-1] >= mark.end_s)
        jumps = series.handover_jump_rad[during(series.reference_s)]
        misses = series.misses[during(series.status_s)]
        baseline = series.record.baseline
        target = np.array(series.record.scenario.targets[report.target])
        found.append(
            ReachFigures(
                outcome=report.outcome,
                reason=report.reason,
                goal_error_m=_goal_error(series, mark.end_s, target) if whole else None,
                min_clearance_m=_least(series.record.clearance_m[during(series.record.time_s)])
                if whole
                else None,
                duration_s=report.duration_s,
                replans=report.replans,
                deadline_misses=int(misses.max()) if len(misses) else 0,
                max_handover_jump_rad=float(jumps.max()) if len(jumps) else 0.0,
                baseline_min_clearance_m=None
                if baseline is None
                else _least(baseline.clearance_m[during(baseline.time_s)]),
            )
        )
    return found


def _goal_error(series: Series, time_s: float, target: FloatArray) -> float:
    """True distance of the tool to the target when the result came [m]."""
    index = min(int(np.searchsorted(series.record.time_s, time_s)), len(series.record.time_s) - 1)
    tool = load_robot().frames(series.record.q[index])[3]
    return float(np.linalg.norm(tool - target))


def summarise(
    series: Series, reports: list[ReachReport], *, wanted: int, bag: Path, seed: int
) -> dict[str, Any]:
    """The content of ``summary.json``.

    Args:
        series: The run.
        reports: The reaches that were begun.
        wanted: Reaches of the scenario.
        bag: Bag folder.
        seed: Seed of the run.
    """
    reaches = reach_figures(series, reports)
    baseline = series.record.baseline
    bad = [reach.outcome for reach in reaches if reach.outcome != "reached"]
    outcome = bad[0] if bad else ("reached" if len(reaches) == wanted else "incomplete")
    rates = {"mocap": 0.0, "prediction": 0.0}
    for body in series.record.scenario.persons:
        rates["mocap"] = max(
            rates["mocap"], series.rates_hz.get(f"/humans/bodies/{body.id}/arm", 0.0)
        )
        rates["prediction"] = max(
            rates["prediction"], series.rates_hz.get(f"/humans/bodies/{body.id}/prediction", 0.0)
        )
    return {
        "outcome": outcome,
        "reaches": [
            {
                "outcome": reach.outcome,
                "reason": reach.reason,
                "goal_error_m": reach.goal_error_m,
                "min_clearance_m": reach.min_clearance_m,
                "baseline_min_clearance_m": reach.baseline_min_clearance_m,
                "duration_s": reach.duration_s,
                "replans": reach.replans,
                "deadline_misses": reach.deadline_misses,
                "max_handover_jump_rad": reach.max_handover_jump_rad,
            }
            for reach in reaches
        ],
        "touched": any(
            reach.min_clearance_m is not None and reach.min_clearance_m <= 0.0 for reach in reaches
        ),
        "baseline_min_clearance_m": None if baseline is None else _least(baseline.clearance_m),
        "mocap_rate_hz": rates["mocap"],
        "prediction_rate_hz": rates["prediction"],
        "latency_ms": {
            "mocap_to_prediction": percentiles(series.mocap_to_prediction_ms),
            "mocap_to_trajectory": percentiles(series.mocap_to_trajectory_ms),
        },
        "bag": str(bag),
        "seed": seed,
    }


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write ``summary.json``; no NaN, no infinity."""
    path.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")


def _cm(value: float | None) -> str:
    return "–" if value is None else f"{value * 100:.1f}"


def succeeded(summary: dict[str, Any]) -> bool:
    """Whether everything was reached and nobody was touched."""
    return summary["outcome"] == "reached" and not summary["touched"]


def print_table(console: Console, summary: dict[str, Any]) -> None:
    """The run as a table."""
    table = Table(title="Reaches", title_justify="left")
    table.add_column("reach")
    table.add_column("outcome")
    for name in (
        "error\nmm",
        "clear\ncm",
        "baseline\nclear cm",
        "time\ns",
        "replans",
        "misses",
        "jump\nmrad",
    ):
        table.add_column(name, justify="right")
    for number, reach in enumerate(summary["reaches"], 1):
        good = reach["outcome"] == "reached"
        least = reach["min_clearance_m"]
        table.add_row(
            str(number),
            f"[green]{reach['outcome']}[/]" if good else f"[red]{reach['outcome']}[/]",
            "–" if reach["goal_error_m"] is None else f"{reach['goal_error_m'] * 1e3:.1f}",
            f"[red]{_cm(least)}[/]" if least is not None and least <= 0 else _cm(least),
            _cm(reach["baseline_min_clearance_m"]),
            f"{reach['duration_s']:.2f}",
            str(reach["replans"]),
            str(reach["deadline_misses"]),
            f"{reach['max_handover_jump_rad'] * 1e3:.3f}",
        )
    console.print(table)
    console.print(
        "clear: smallest true distance robot-person; baseline: the same without replanning; "
        "misses: plans dropped as late; jump: of the reference at hand-overs",
        highlight=False,
    )
    for number, reach in enumerate(summary["reaches"], 1):
        if reach["outcome"] != "reached":
            console.print(f"reach {number}: {reach['reason']}", highlight=False, markup=False)
        if reach["goal_error_m"] is None:
            console.print(f"reach {number}: the recording ended before it did", highlight=False)
    if summary["touched"]:
        console.print("[red]the robot touched the person[/]: a true clearance is not above 0")
    latency = summary["latency_ms"]["mocap_to_trajectory"]
    if latency["p50"] is not None:
        console.print(
            f"mocap {summary['mocap_rate_hz']:.0f} Hz, predictions "
            f"{summary['prediction_rate_hz']:.0f} Hz, newest sample to published trajectory "
            f"{latency['p50']:.0f} ms median, {latency['p99']:.0f} ms p99",
            highlight=False,
        )
