"""What a run comes to: figures for the table and for ``summary.json``."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hri_planner.robot.model import load_robot
from hri_prediction.ros.time import NANO
from hri_sim.launch.freezing import stopped_words
from hri_sim.launch.record import Series
from hri_sim.launch.reports import INTERRUPTED, ReachReport
from hri_sim.launch.separation import OFF
from hri_sim.recording.folders import bag_folders
from hri_sim.scenario.schema import Scenario

FloatArray = NDArray[np.float64]
SUMMARY = "summary.json"
"""File in the folder of a run."""
LATE_SHARE = 0.02
"""Share of late plans from which they are told of."""
BUSY_SHARE = 0.1
"""Share of late plans from which a run says more of the machine than of the planner."""
HOST_SHARE = 0.02
"""Share of a virtual machine that its host takes from which it is told of beside late plans."""


@dataclass(frozen=True)
class ReachFigures:
    """Figures of one reach; see :func:`summarise`. None: not recorded, or nobody was there.

    The clearance of a reach that was not recorded to its end is the smallest that was seen live.
    """

    outcome: str
    reason: str
    duration_s: float
    replans: int
    goal_error_m: float | None = None
    min_clearance_m: float | None = None
    deadline_misses: int | None = None
    max_handover_jump_rad: float | None = None
    baseline_min_clearance_m: float | None = None


def percentiles(values: FloatArray) -> dict[str, float | None]:
    """Median and 99th percentile; none of an empty array."""
    if not len(values):
        return {"p50": None, "p99": None}
    return {"p50": float(np.percentile(values, 50)), "p99": float(np.percentile(values, 99))}


def _least(values: FloatArray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(finite.min()) if len(finite) else None


def reach_figures(series: Series | None, reports: list[ReachReport]) -> list[ReachFigures]:
    """Figures of each reach; a reach lasts from its cue to the next one's, the rest included."""
    said = [
        ReachFigures(
            r.outcome, r.reason, r.duration_s, r.replans, min_clearance_m=r.min_clearance_m
        )
        for r in reports
    ]
    if series is None:
        return said
    marks = series.record.reaches
    found = []
    for number, (report, reach, mark) in enumerate(zip(reports, said, marks, strict=True)):
        # A recorder that died left no witness: then what was seen live counts, not what it last saw.
        if not _recorded(series, mark.start_s, (report.over_ns - series.origin_ns) / NANO):
            found.append(reach)
            continue
        end = marks[number + 1].start_s if number + 1 < len(marks) else np.inf

        def during(times: FloatArray, begin: float = mark.start_s, until: float = end) -> Any:
            return (times >= begin) & (times < until)

        jumps = series.handover_jump_rad[during(series.reference_s)]
        misses = series.misses[during(series.status_s)]
        baseline = series.record.baseline
        target = np.array(report.goal or series.record.scenario.targets[report.target])
        found.append(
            replace(
                reach,
                goal_error_m=_goal_error(series, mark.end_s, target),
                min_clearance_m=_least(series.record.clearance_m[during(series.record.time_s)]),
                deadline_misses=int(misses.max()) if len(misses) else 0,
                max_handover_jump_rad=float(jumps.max()) if len(jumps) else 0.0,
                baseline_min_clearance_m=None
                if baseline is None
                else _least(baseline.clearance_m[during(baseline.time_s)]),
            )
        )
    return found


def _recorded(series: Series, begin_s: float, end_s: float) -> bool:
    """Whether a bag was recorded all the time from one time to another."""
    between = any(begin_s < end and begin < end_s for begin, end in series.gaps_s)
    return not between and bool(end_s <= series.record.time_s[-1])


def _ended_early_s(series: Series | None, reports: list[ReachReport]) -> float | None:
    """How long before the last reach was over the recording ended [s]; None: nothing was recorded."""
    if series is None or not reports:
        return None
    end_s = (max(report.over_ns for report in reports) - series.origin_ns) / NANO
    return max(end_s - float(series.record.time_s[-1]), 0.0)


def _least_of_baseline(series: Series | None) -> float | None:
    """Smallest clearance of the baseline while its people, those of the recording, were recorded."""
    if series is None or series.record.baseline is None:
        return None
    baseline = series.record.baseline
    known = np.ones(len(baseline.time_s), dtype=bool)
    for begin, end in series.gaps_s:
        known &= (baseline.time_s < begin) | (baseline.time_s > end)
    return _least(baseline.clearance_m[known])


def _goal_error(series: Series, time_s: float, target: FloatArray) -> float:
    """True distance of the tool to the target when the result came [m]."""
    index = min(int(np.searchsorted(series.record.time_s, time_s)), len(series.record.time_s) - 1)
    tool = load_robot().frames(series.record.q[index])[3]
    return float(np.linalg.norm(tool - target))


def summarise(
    series: Series | None, reports: list[ReachReport], *, scenario: Scenario, bag: Path, seed: int
) -> dict[str, Any]:
    """The content of ``summary.json``.

    Args:
        series: The run; none when it was not recorded: what only a bag can tell is null then.
        reports: The reaches that were begun.
        scenario: What was to be done.
        bag: Bag folder.
        seed: Seed of the run.
    """
    reaches = reach_figures(series, reports)
    bad = [reach.outcome for reach in reaches if reach.outcome != "reached"]
    outcome = (
        bad[0] if bad else ("reached" if len(reaches) == len(scenario.reaches) else INTERRUPTED)
    )

    def rate(topic: str) -> float | None:
        if series is None or not scenario.persons:
            return None
        return max(
            series.rates_hz.get(f"/humans/bodies/{person.id}/{topic}", 0.0) / len(person.arms)
            for person in scenario.persons
        )

    touched = any(r.min_clearance_m is not None and r.min_clearance_m <= 0.0 for r in reaches)
    # Nothing is known of a person whom neither the bag nor anybody live has seen.
    known = not scenario.persons or (
        bool(reaches) and all(reach.min_clearance_m is not None for reach in reaches)
    )
    nothing = np.zeros(0)
    return {
        "outcome": outcome,
        "reaches": [asdict(reach) for reach in reaches],
        "reaches_asked": len(scenario.reaches),
        "touched": touched if touched or known else None,
        "baseline_min_clearance_m": _least_of_baseline(series),
        "mocap_rate_hz": rate("arm"),
        "prediction_rate_hz": rate("prediction"),
        "latency_ms": {
            "mocap_to_prediction": percentiles(
                nothing if series is None else series.mocap_to_prediction_ms
            ),
            "mocap_to_trajectory": percentiles(
                nothing if series is None else series.mocap_to_trajectory_ms
            ),
        },
        "bag": str(bag),
        "bags": [str(path) for path in bag_folders(bag)],
        "recording_gaps_s": [] if series is None else [list(gap) for gap in series.gaps_s],
        "recording_ended_early_s": _ended_early_s(series, reports),
        "seed": seed,
    }


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write ``summary.json``; no NaN, no infinity."""
    path.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n")


def late_replans(reaches: list[dict[str, Any]]) -> tuple[int, int]:
    """Plans dropped as late, and all plans, of the reaches that were recorded."""
    known = [reach for reach in reaches if reach["deadline_misses"] is not None]
    misses = sum(reach["deadline_misses"] for reach in known)
    return misses, misses + sum(reach["replans"] for reach in known)


def _late_words(summary: dict[str, Any]) -> str:
    """What is said of late plans; empty when they were few."""
    misses, plans = late_replans(summary["reaches"])
    if misses <= LATE_SHARE * plans:
        return ""
    share = f"{misses} of {plans} plans ({misses / plans:.0%})"
    # A monitor changes the speed while a plan is made for the speed before.
    if summary.get("separation", OFF) != OFF:
        return (
            f"{share} were dropped: late, or made for a robot as fast as it was before the monitor "
            "changed that"
        )
    said = f"{share} were late and dropped"
    if summary.get("stopped_s"):
        return f"{said}: {stopped_words(summary['stopped_s'])}"
    busy = misses > BUSY_SHARE * plans
    if (taken := summary.get("host_share", 0.0)) > HOST_SHARE:
        said += (
            f"; the host of this virtual machine took {taken:.0%} of its processor time meanwhile"
        )
    if busy:
        said += f", more than {BUSY_SHARE:.0%}: the machine was too busy for figures"
    return said


def number(value: float | None, style: str, factor: int | float = 1) -> str:
    """A figure as text; a dash when it is not known."""
    return "–" if value is None else format(value * factor, style)


def _cm(value: float | None) -> str:
    return number(value, ".1f", 100.0)


def succeeded(summary: dict[str, Any]) -> bool:
    """Whether everything was reached and nobody is known to have been touched."""
    return summary["outcome"] == "reached" and not summary["touched"]


def print_table(console: Console, summary: dict[str, Any]) -> None:
    """The run as a table, for 80 columns."""
    table = Table(title="Reaches", title_justify="left")
    table.add_column("#", justify="right")
    table.add_column("outcome")
    for name in (
        "error\nmm",
        "clear\ncm",
        "base\ncm",
        "time\ns",
        "plans",
        "late",
        "jump\nmrad",
    ):
        table.add_column(name, justify="right")
    for count, reach in enumerate(summary["reaches"], 1):
        good = reach["outcome"] == "reached"
        least = reach["min_clearance_m"]
        clear = _cm(least)
        if least is None and reach["goal_error_m"] is not None:  # recorded: there was nobody
            clear = "nobody"
        table.add_row(
            str(count),
            f"[green]{reach['outcome']}[/]" if good else f"[red]{reach['outcome']}[/]",
            number(reach["goal_error_m"], ".1f", 1e3),
            f"[red]{clear}[/]" if least is not None and least <= 0 else clear,
            _cm(reach["baseline_min_clearance_m"]),
            f"{reach['duration_s']:.2f}",
            str(reach["replans"]),
            number(reach["deadline_misses"], "d"),
            number(reach["max_handover_jump_rad"], ".3f", 1e3),
        )
    console.print(table)
    console.print(
        "clear: smallest true distance robot-person; base: the same without replanning; "
        "plans: replans that took effect; late: those dropped; jump: of the reference at hand-overs; "
        "–: there is none, or it was not recorded",
        highlight=False,
    )
    begun = len(summary["reaches"])
    asked = summary.get("reaches_asked", begun)
    if begun < asked:
        console.print(f"{begun} of {asked} reaches begun", highlight=False)
    for begin, end in summary.get("recording_gaps_s", ()):
        console.print(
            f"nothing was recorded from {begin:.2f} to {end:.2f} s; figures are of what was recorded",
            highlight=False,
        )
    for count, reach in enumerate(summary["reaches"], 1):
        if reach["outcome"] != "reached":
            console.print(f"reach {count}: {reach['reason']}", highlight=False, markup=False)
        if reach["goal_error_m"] is None:
            console.print(
                f"reach {count} was not recorded from begin to end; its clearance was seen live",
                highlight=False,
            )
    text = _late_words(summary)
    if text:
        console.print(text, highlight=False)
    if summary["touched"]:
        console.print("[red]the robot touched the person[/]: a true clearance is not above 0")
    latency = summary["latency_ms"]["mocap_to_trajectory"]
    if latency["p50"] is not None:
        rate_hz = summary["prediction_rate_hz"]
        predicted = f"predictions {rate_hz:.0f} Hz, " if rate_hz else ""
        console.print(
            f"mocap {summary['mocap_rate_hz']:.0f} Hz, {predicted}newest sample to published trajectory "
            f"{latency['p50']:.0f} ms median, {latency['p99']:.0f} ms p99",
            highlight=False,
        )
