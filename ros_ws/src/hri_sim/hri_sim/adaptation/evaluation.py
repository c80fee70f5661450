"""How good adaptation is in tasks that nothing was learnt from."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np

from hri_planner.adaptation.algorithm1 import RULES
from hri_planner.adaptation.grid import CELLS, Cell
from hri_planner.ptomp.config import load_default_config
from hri_prediction.arm.geometry import FloatArray
from hri_sim.adaptation.design import RANDOM, Design, Job, Trial
from hri_sim.adaptation.samples import Sample
from hri_sim.adaptation.training import LabelErrors, Models, Samples, labelled, of_tasks
from hri_sim.benchmark.intervals import mean_of, share_difference_interval, share_interval
from hri_sim.benchmark.rows import Unit

DEFAULT = "default"
"""What is configured when nothing adapts."""
FIXED = "fixed"
ADAPTING = ("gpr", "gpr_lower", "success")
SEED_SD = (4.17, 5.48)
"""The thesis' standard deviations of the errors of TS and NT, in 50 conditions."""
_EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0)


def default_cell() -> Cell:
    """The parameters of the parameter file."""
    config = load_default_config()
    return Cell(config.num_timesteps, config.num_rollouts)


def chosen_jobs(design: Design, samples: Samples, models: Models) -> list[Job]:
    """What each model chooses in the conditions of held-out tasks, to be simulated."""
    jobs = []
    for name in (*models.by_name, DEFAULT):
        model = models.by_name.get(name)
        for task in design.held_out:
            for seed in design.seeds:
                first = {s.condition: s for s in reversed(samples[Unit(RANDOM, seed, task)])}
                trials = tuple(
                    Trial(number, default_cell() if model is None else model.choose(s.situation))
                    for number, s in sorted(first.items())
                )
                jobs.append(Job(Unit(name, seed, task), trials))
    return jobs


def evaluate(
    design: Design, samples: Samples, models: Models, errors: LabelErrors, chosen: Samples
) -> dict[str, Any]:
    """The content of ``results.json``.

    Args:
        design: What was simulated.
        samples: Of the grid and random cells.
        models: Trained on the learnt tasks.
        errors: Of labels, each time in a task that was left out.
        chosen: Samples of :func:`chosen_jobs`.
    """
    rules = Counter(each.label.rule for each in labelled(samples, design.learnt))
    motions = of_tasks(samples, design.held_out, grid=False)
    expected = np.array([_expected(models, sample) for sample in motions])
    good = np.array([float(sample.success) for sample in motions])
    base = np.mean([float(s.success) for s in of_tasks(samples, design.learnt, grid=False)])
    return {
        "budget": design.slowdown,
        "tasks": {"learnt": list(design.learnt), "held_out": list(design.held_out)},
        "motions": {"learnt": len(of_tasks(samples, design.learnt)), "held_out": len(motions)},
        "labels": {rule: rules[rule] for rule in RULES},
        "label_sd": {
            "conditions": len(errors.gpr),
            "gpr": errors.gpr_sd.tolist(),
            "always_the_mean": errors.mean_sd.tolist(),
            "thesis": list(SEED_SD),
        },
        "success_model": {
            "brier": float(np.mean((expected - good) ** 2)),
            "brier_of_the_mean": float(np.mean((base - good) ** 2)),
            "calibration": _calibration(expected, good),
        },
        "planners": {name: _figures(design, chosen, name) for name in (*models.by_name, DEFAULT)},
    }


def _expected(models: Models, sample: Sample) -> float:
    return float(models.success.success(sample.situation)[CELLS.index(sample.cell)])


def _calibration(expected: FloatArray, good: FloatArray) -> list[dict[str, float]]:
    """Mean expected and true share of success where so much was expected."""
    place = np.clip(np.digitize(expected, _EDGES) - 1, 0, len(_EDGES) - 2)
    rows = []
    for k in np.unique(place):
        there = place == k
        rows.append(
            {
                "from": _EDGES[k],
                "to": _EDGES[k + 1],
                "motions": int(there.sum()),
                "expected": float(expected[there].mean()),
                "true": float(good[there].mean()),
            }
        )
    return rows


def _figures(design: Design, chosen: Samples, name: str) -> dict[str, Any]:
    """What became of the motions of one model."""
    every = [s for unit, found in chosen.items() if unit.planner == name for s in found]
    good = [sample.control for sample in every if sample.ok]
    return {
        **_share(design, chosen, name, "ok"),
        **_share(design, chosen, name, "success"),
        "control": float(np.mean(good)) if good else None,
        "motions": len(every),
        "iterations": float(np.mean([sample.iterations for sample in every])),
        "num_timesteps": float(np.mean([sample.num_timesteps for sample in every])),
        "num_rollouts": float(np.mean([sample.num_rollouts for sample in every])),
    }


def _share(design: Design, chosen: Samples, name: str, figure: str) -> dict[str, Any]:
    """How often a figure of samples is true, also less that of the best fixed cell, with intervals."""
    sums, best = _counts(design, chosen, name, figure), _counts(design, chosen, FIXED, figure)
    return {
        figure: mean_of(sums),
        f"{figure}_ci95": share_interval(sums),
        f"{figure}_less_fixed": (mean_of(sums) or 0.0) - (mean_of(best) or 0.0),
        # The best fixed cell less itself is nothing, and that is certain.
        f"{figure}_less_fixed_ci95": (
            [0.0, 0.0] if name == FIXED else share_difference_interval(sums, best)
        ),
    }


def _counts(design: Design, chosen: Samples, name: str, figure: str) -> FloatArray:
    """How often a figure is true, and of how many motions, in each held-out task (tasks, 2)."""
    rows = []
    for task in design.held_out:
        units = [unit for unit in chosen if unit.planner == name and unit.task == task]
        found = [getattr(sample, figure) for unit in units for sample in chosen[unit]]
        rows.append((float(sum(found)), float(len(found))))
    return np.array(rows)


def _shares(row: dict[str, Any], figure: str) -> str:
    """Three cells of the table: a share, its interval, and what it is more than the best fixed cell's."""
    low, high = row[f"{figure}_ci95"]
    worse, better = row[f"{figure}_less_fixed_ci95"]
    return (
        f"{100 * row[figure]:.1f} % | {100 * low:.1f}–{100 * high:.1f} "
        f"| {100 * row[f'{figure}_less_fixed']:+.1f} ({100 * worse:+.1f} to {100 * better:+.1f})"
    )


def report(results: dict[str, Any]) -> str:
    """The results as Markdown."""
    sd, model = results["label_sd"], results["success_model"]
    tasks, default = results["tasks"], results["planners"][DEFAULT]
    lines = [
        f"# Parameter adaptation, F = {results['budget']:g}",
        "",
        f"Learnt from {results['motions']['learnt']} motions of {len(tasks['learnt'])} tuning tasks; "
        f"motions and chances of success below are of {len(tasks['held_out'])} other tuning tasks. Where "
        f"nothing adapts, PTOMP does {default['iterations']:.0f} iterations a motion at this F.",
        "",
        "| chosen by | ok | 95 % | less the best fixed cell, points | ≥ 5 cm clear | 95 % "
        "| less the best fixed cell, points | control cost of those ok | mean TS | mean NT "
        "| iterations a motion | motions |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, row in results["planners"].items():
        control = "–" if row["control"] is None else f"{row['control']:.0f}"
        lines.append(
            f"| `{name}` | {_shares(row, 'ok')} | {_shares(row, 'success')} | {control} "
            f"| {row['num_timesteps']:.1f} | {row['num_rollouts']:.1f} "
            f"| {row['iterations']:.0f} | {row['motions']} |"
        )
    better_than = [
        name for name in ADAPTING if results["planners"][name]["success_less_fixed_ci95"][0] > 0
    ]
    lines += [
        "",
        f"More often 5 cm clear than with the best fixed cell: {' and '.join(better_than)}."
        if better_than
        else "No adaptation is better than the best fixed cell by more than chance.",
        "",
        f"Labels of Algorithm 1: {sd['conditions']} conditions of the tasks learnt from. Errors are those "
        "in each task when all is learnt from the others; `gpr_lower` subtracts the first row.",
        "",
        "| errors of labels (SD) | TS | NT |",
        "| --- | --- | --- |",
        f"| Gaussian processes | {sd['gpr'][0]:.2f} | {sd['gpr'][1]:.2f} |",
        f"| always the mean label | {sd['always_the_mean'][0]:.2f} | {sd['always_the_mean'][1]:.2f} |",
        f"| the thesis, 50 conditions | {sd['thesis'][0]} | {sd['thesis'][1]} |",
        "",
        "| label given by | conditions |",
        "| --- | --- |",
        *(f"| {rule} | {count} |" for rule, count in results["labels"].items()),
        "",
        "| success expected | motions | mean | true |",
        "| --- | --- | --- | --- |",
    ]
    lines += [
        f"| {row['from']:.2f}–{row['to']:.2f} | {row['motions']} | {row['expected']:.3f} "
        f"| {row['true']:.3f} |"
        for row in model["calibration"]
    ]
    lines += [
        "",
        f"Brier score {model['brier']:.4f}; of the mean share of success {model['brier_of_the_mean']:.4f}.",
        "",
    ]
    return "\n".join(lines)
