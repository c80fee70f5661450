"""Many simulated people, each with an experiment of their own, without ROS."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from rich.table import Table

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment import Experiment
from hri_planner.robot.model import load_robot
from hri_sim.readability.learning import Learnt, learn

PEOPLE = "people.jsonl"
"""A line for each person of a batch."""


@dataclass(frozen=True, eq=False)
class PersonRow:
    """What came of one person's experiment.

    Attributes:
        seed: Of the person.
        last: The policy in the end.
        row: Figures that JSON can hold.
    """

    seed: int
    last: DmpPolicy
    row: dict[str, Any]


def person_row(learnt: Learnt) -> PersonRow:
    """Of what one person taught."""
    learning = [result for result in learnt.results if result.trial.update >= 0]
    last = max(result.trial.update for result in learning)

    def cost(update: int) -> float:
        return float(np.mean([r.cost for r in learning if r.trial.update == update]))

    row = {
        "seed": learnt.seed,
        "improved": learnt.improved,
        "pred_time_change": learnt.after.prediction_time / learnt.before.prediction_time - 1.0,
        "error_change": learnt.after.error - learnt.before.error,
        "contacts": learnt.contacts + learnt.before.contacts + learnt.after.contacts
        + learnt.others_before.contacts + learnt.others_after.contacts,
        "broken_off": learnt.broken_off + learnt.before.broken_off + learnt.after.broken_off
        + learnt.others_before.broken_off + learnt.others_after.broken_off,
        "cost_first": cost(0),
        "cost_last": cost(last),
        "before": asdict(learnt.before),
        "after": asdict(learnt.after),
        "others_before": asdict(learnt.others_before),
        "others_after": asdict(learnt.others_after),
    }  # fmt: skip
    return PersonRow(learnt.seed, learnt.last, row)


def learn_all(
    experiment: Experiment,
    seeds: Sequence[int],
    *,
    first: DmpPolicy | None,
    readings: int,
    workers: int,
    folder: Path,
    progress: Callable[[int, int, str], None],
) -> list[PersonRow]:
    """One experiment for each person, in parallel.

    Args:
        experiment: What is done.
        seeds: Of the people.
        first: The policy to begin with; none: the experiment's initial one.
        readings: Trials of each goal by which the first and the last policy are compared.
        workers: Processes; 0: one a core.
        folder: Gets ``people.jsonl``, a line for each person as soon as it is done.
        progress: Told how many are done, of how many, and how it went.
    """
    jobs = [joblib.delayed(_learn)(experiment, seed, first, readings) for seed in seeds]
    rows = []
    parallel = joblib.Parallel(
        n_jobs=workers or os.cpu_count() or 1, return_as="generator_unordered"
    )
    progress(0, len(jobs), "")
    with (folder / PEOPLE).open("w") as lines:
        for row in parallel(jobs):
            rows.append(row)
            lines.write(json.dumps(row.row) + "\n")
            lines.flush()
            share = float(np.mean([other.row["improved"] for other in rows]))
            progress(len(rows), len(jobs), f"{100 * share:.0f} % have improved")
    return sorted(rows, key=lambda row: row.seed)


def _learn(experiment: Experiment, seed: int, first: DmpPolicy | None, readings: int) -> PersonRow:
    return person_row(learn(load_robot(), experiment, seed, first=first, readings=readings))


def figures_of(rows: Sequence[PersonRow]) -> dict[str, Any]:
    """Figures over all people."""

    def mean(name: str) -> float:
        return float(np.mean([row.row[name] for row in rows]))

    return {
        "seeds": len(rows),
        "improved_share": mean("improved"),
        "pred_time_change": mean("pred_time_change"),
        "error_change": mean("error_change"),
        "contacts": int(sum(row.row["contacts"] for row in rows)),
        "broken_off": int(sum(row.row["broken_off"] for row in rows)),
        "cost_first": mean("cost_first"),
        "cost_last": mean("cost_last"),
    }


def batch_table(rows: Sequence[PersonRow]) -> tuple[Table, dict[str, Any]]:
    """A table of all people, and the figures over them."""
    table = Table(title="How people read the first and the last policy")
    for name in (
        "person",
        "J_pred [s]",
        "change",
        "wrong",
        "other person [s]",
        "wrong",
        "cost",
        "touched",
        "broken off",
    ):
        table.add_column(name, justify="right")
    arrow = functools.partial("{} → {}".format)
    for row in rows:
        own = row.row
        before, after = own["before"], own["after"]
        other, later = own["others_before"], own["others_after"]
        table.add_row(
            str(row.seed) + ("" if own["improved"] else " *"),
            arrow(f"{before['prediction_time']:.2f}", f"{after['prediction_time']:.2f}"),
            f"{100 * own['pred_time_change']:+.0f} %",
            arrow(f"{100 * before['error']:.1f}", f"{100 * after['error']:.1f} %"),
            arrow(f"{other['prediction_time']:.2f}", f"{later['prediction_time']:.2f}"),
            arrow(f"{100 * other['error']:.1f}", f"{100 * later['error']:.1f} %"),
            arrow(f"{own['cost_first']:.1f}", f"{own['cost_last']:.1f}"),
            str(own["contacts"]),
            str(own["broken_off"]),
        )
    figures = figures_of(rows)
    table.caption = (
        f"{100 * figures['improved_share']:.0f} % of {figures['seeds']} people take at least 10 % less "
        "time and are not wrong more often (the others: *)"
    )
    return table, figures
