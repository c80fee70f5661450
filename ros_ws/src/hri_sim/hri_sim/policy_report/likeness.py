"""Table 5.3: paths of a policy and of ProMPs beside those of people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.metrics.divergence import path_model
from hri_planner.rnn.model_file import load_policy
from hri_sim.benchmark.report import markdown_table
from hri_sim.dyads.setups import draw_setups
from hri_sim.policies.evaluation import situations
from hri_sim.policies.evaluation_report import number
from hri_sim.policies.likeness_table import among_people, compared, policy_paths
from hri_sim.policy_report import thesis
from hri_sim.policy_report.laboratory import Laboratory
from hri_sim.policy_report.routes import on_one_way

FloatArray = NDArray[np.float64]

SETUPS = 6
COUNT, FITTED = 36, 15
SMOKE_COUNT, SMOKE_FITTED = 10, 5
STREAM = 53
DIRECTIONS = ("forward", "backward")
CASES = {
    "test": "fitted to the test itself",
    "apart": f"fitted to {FITTED} of {COUNT}, tested on the others",
}
THEIR_CELL = "lstm"
"""Of the policies that the thesis compares with ProMPs; its are larger."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Rows by case and direction, means over setups."""
    policies = laboratory.compared()
    setups = 1 if laboratory.smoke else SETUPS
    work = partial(
        _one_setup,
        files={one.job.config.cell: one.file(laboratory.runs) for one in policies},
        count=SMOKE_COUNT if laboratory.smoke else COUNT,
        fitted=SMOKE_FITTED if laboratory.smoke else FITTED,
    )
    found = laboratory.all("likeness", work, list(range(setups)))
    cases = {
        case: {
            direction: {row: _mean([one[case][direction][row] for one in found]) for row in rows}
            for direction, rows in directions.items()
        }
        for case, directions in found[0].items()
    }
    return {"setups": setups, "policies": {p.job.config.cell: p.name for p in policies}, **cases}


def _mean(rows: Sequence[Mapping[str, float | None]]) -> dict[str, float | None]:
    """By column; none where there is none."""
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    known = {name: [v for v in values if v is not None] for name, values in columns.items()}
    return {name: float(np.mean(values)) if values else None for name, values in known.items()}


def _one_setup(
    index: int, files: Mapping[str, Path], count: int, fitted: int
) -> dict[str, dict[str, dict[str, Any]]]:
    rng = np.random.default_rng((STREAM, index))
    setup = draw_setups(index + 1, rng)[index]
    ways = dict(zip(DIRECTIONS, on_one_way(setup, count, rng), strict=True))
    found: dict[str, dict[str, dict[str, Any]]] = {"test": {}, "apart": {}}
    for direction, encounters in ways.items():
        found["test"][direction] = _rows(encounters, encounters, files, rng)
        found["apart"][direction] = _rows(encounters[:fitted], encounters[fitted:], files, rng)
    return found


def _rows(
    fitted: Sequence[Encounter],
    tested: Sequence[Encounter],
    files: Mapping[str, Path],
    rng: np.random.Generator,
) -> dict[str, Any]:
    human = situations(tested).human
    rows: dict[str, Any] = {"promp": compared(promp_samples(fitted, len(tested), rng), human)}
    for cell, file in files.items():
        rows[cell] = compared(policy_paths(load_policy(file), tested, rng), human)
    rows["human"] = among_people(human, rng)
    return rows


def promp_samples(
    fitted: Sequence[Encounter], count: int, rng: np.random.Generator
) -> list[FloatArray]:
    """Paths drawn from a ProMP of the people's [m], each as long as theirs are on average."""
    paths = situations(fitted).human
    model = path_model(paths)
    phases = np.linspace(0.0, 1.0, max(round(float(np.mean([len(path) for path in paths]))), 2))
    return list(model.sample(phases, rng, count))


def lines(found: Mapping[str, Any]) -> list[str]:
    """The table."""
    rows = []
    for direction in DIRECTIONS:
        for case, said in CASES.items():
            for name, one in found[case][direction].items():
                theirs = {"promp": "promp", THEIR_CELL: "policy"}.get(name, "")
                his = thesis.LIKENESS[direction, case].get(theirs)
                rows.append(
                    [
                        direction,
                        said if name == "promp" else "",
                        {"promp": "ProMP", "human": "people"}.get(name, name),
                        number(one["mean"], 4),
                        f"{number(one['sample'], 4)} ± {number(one['sample_sd'], 3)}",
                        number(one["paired"], 4),
                        number(one["coverage"]),
                        f"{his[0]}, {his[1]}" if his else "–",
                    ]
                )
    names = ", ".join(f"{cell}: `{name}`" for cell, name in found["policies"].items())
    return [
        f"Dynamic time warping [mm]: the sum of Euclidean distances along the cheapest way, of paths until "
        f"the goal is reached; in {found['setups']} unseen setups, of {COUNT} encounters from home to a "
        f"target and as many back, means over setups. Policies: {names}. Mean: mean path beside the "
        "people's mean path; sample: each path beside the people's next to it, which rewards paths that "
        "are all alike; paired: beside the person's in the same encounter (a ProMP knows of no "
        "encounters); coverage: share of the people's paths that are the nearest of some made one. "
        "*People*: each beside the nearest of the others, and the mean of one half beside that of the "
        "other. The ProMP is told start, goal and duration by its paths, the policies have seen neither "
        "these setups nor these people. Last column: the thesis' mean and sample, of a larger LSTM.\n",
        markdown_table(["", "ProMP", "", "mean", "sample", "paired", "coverage", "thesis"], rows),
    ]
