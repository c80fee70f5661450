"""Figures and table of the planners in real time."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hri_planner.ptomp.budget import GATHER_S, POSTURE_S, PREDICTION_S, START_S
from hri_prediction.errors import ConfigError
from hri_prediction.results.origin import origin_line, results_origin
from hri_sim.benchmark.conditions import TASKS, task_conditions
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.realtime import COMPUTE_SHARE, READY_S, Times, measure_condition
from hri_sim.benchmark.report import markdown_table, share_text
from hri_sim.benchmark.run import Plan
from hri_sim.warm import warm_kernels

REALTIME_TASKS = tuple(range(0, TASKS, 3))
"""Tasks of which the first condition is run; some of them are ambiguous."""

_PRICE_TEXTS = {
    "prediction": "prediction: samples of an interval, one forecast",
    "gathering_met": "other motions compared, the plan meets the person",
    "gathering": "the same, whether or not it does",
    "posture": "each final posture that is looked for",
    "start": "first final posture and the motion to it",
    "iteration": "an iteration (charged: median of the cost model)",
}


def measure_planners(plan: Plan, progress: Callable[[int, int], None]) -> dict[str, Any]:
    """The content of ``realtime.json``.

    Args:
        plan: Planners, split, seeds, tasks, conditions of each, variation and execution.
        progress: Called with the numbers of conditions done and of all.

    Raises:
        ConfigError: when none of the planners replans.
    """
    setups = [setup for setup in plan.planners if setup.observer is not None]
    if not setups:
        raise ConfigError("--real-time without a planner that replans", hint="name one, as ptomp")
    origin, load = results_origin(), os.getloadavg()[0]
    warm_kernels()
    cases = [
        (condition, seed)
        for task in plan.tasks
        for condition in task_conditions(plan.split, task).conditions[: plan.conditions]
        for seed in plan.seeds
    ]
    progress(0, len(setups) * len(cases))
    times = {setup.name: Times() for setup in setups}
    for number, (condition, seed) in enumerate(cases):
        library = task_library(plan.split, condition.task.number)
        # Planners take turns, so that what else the machine does meets all alike.
        for place, setup in enumerate(setups):
            measure_condition(
                condition,
                setup,
                library,
                times[setup.name],
                seed=seed,
                variation=plan.variation,
                execution=plan.execution,
            )
            progress(number * len(setups) + place + 1, len(setups) * len(cases))
    return {
        "origin": origin,
        "load_before": load,
        "split": plan.split,
        "conditions": len(cases) // len(plan.seeds),
        "seeds": list(plan.seeds),
        "variation": plan.variation.text,
        "execution": plan.execution,
        "compute_share": COMPUTE_SHARE,
        "ready_before_ms": 1e3 * READY_S,
        "planners": {name: figures(found) for name, found in times.items()},
    }


def figures(times: Times) -> dict[str, Any]:
    """Figures of one planner [ms]."""
    replans = len(times.replan)
    charges = {
        "prediction": (PREDICTION_S, times.prediction),
        "gathering_met": (GATHER_S, times.gather_met),
        "gathering": (GATHER_S, times.gather),
        "posture": (POSTURE_S, times.posture),
        "start": (START_S, times.start),
        "iteration": (float(np.median(times.iteration_charge or [0.0])), times.iteration),
    }
    return {
        "interval_ms": 1e3 * times.interval_s,
        "replans": replans,
        "missed_share": times.missed / replans,
        "failures": times.failures,
        "iterations_a_replan": times.iterations / replans,
        "replan_ms": percentiles(times.replan, (50, 99, 100)),
        "iteration_ms": percentiles(times.iteration, (50, 99)),
        "ok": sum(times.ok) / len(times.ok),
        "prices_ms": {
            name: {"charged": 1e3 * charge, **(percentiles(found, (10, 50, 99)) or {})}
            for name, (charge, found) in charges.items()
            if found
        },
    }


def percentiles(values_s: Sequence[float], of: Sequence[int]) -> dict[str, float] | None:
    """Percentiles by name, as in ``p50`` [ms]; none without values."""
    if not values_s:
        return None
    found = 1e3 * np.percentile(values_s, of)
    return {f"p{share}": float(value) for share, value in zip(of, found, strict=True)}


def realtime_report(results: Mapping[str, Any]) -> str:
    """The content of ``realtime.md``."""
    rows = []
    for name, found in results["planners"].items():
        replan, iteration = found["replan_ms"], found["iteration_ms"]
        rows.append(
            [
                f"`{name}`",
                f"{found['interval_ms']:.1f}",
                str(found["replans"]),
                f"{replan['p50']:.1f} / {replan['p99']:.1f} / {replan['p100']:.1f}",
                share_text(found["missed_share"], None),
                "–" if iteration is None else f"{iteration['p50']:.3f} / {iteration['p99']:.3f}",
                f"{found['iterations_a_replan']:.0f}",
                share_text(found["ok"], None),
            ]
        )
    head = [
        "planner",
        "interval [ms]",
        "replans",
        "replan p50 / p99 / max [ms]",
        "missed",
        "iteration p50 / p99 [ms]",
        "iterations a replan",
        "ok",
    ]
    parts = [
        "# Planners in real time\n",
        f"{results['conditions']} conditions of the {results['split']} tasks, seeds "
        f"{', '.join(map(str, results['seeds']))}, one process, by the wall clock. Other than drawn: "
        f"{results['variation']}; executed: {results['execution']}. A replan may take "
        f"{100 * results['compute_share']:.0f} % of its interval; missed are those that were not ready "
        f"{results['ready_before_ms']:g} ms before their hand-over.\n",
        markdown_table(head, rows),
        "Prices of a replan's parts [ms], beside what virtual time charges for them at F = 1:\n",
    ]
    for name, found in results["planners"].items():
        prices = [
            [
                text,
                f"{price['charged']:.3f}",
                *(f"{price[key]:.3f}" for key in ("p10", "p50", "p99")),
            ]
            for kind, text in _PRICE_TEXTS.items()
            if (price := found["prices_ms"].get(kind)) is not None
        ]
        parts.append(markdown_table([f"`{name}`", "charged", "p10", "p50", "p99"], prices))
    parts.append(
        f"Load before: {results['load_before']:.2f}. Made by `scripts/benchmark_planners.py --real-time`. "
        f"{origin_line(results['origin'])}\n"
    )
    return "\n".join(parts)
