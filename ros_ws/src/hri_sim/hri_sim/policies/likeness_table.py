"""Table 5.3: how like people policies and ProMPs move, by dynamic time warping.

Distances are sums of Euclidean distances along the cheapest way, in millimetres, of paths until the
goal is reached. Beside the thesis' sample measure, which rewards paths that are all alike, stand the
paired measure and coverage. The human row is of people among themselves: each path's nearest among
the others, and the mean path of one random half beside that of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.metrics.divergence import path_model
from hri_planner.rnn.metrics.reaching import reach_steps
from hri_planner.rnn.metrics.warping import distances, likeness
from hri_planner.rnn.model import PolicyModel
from hri_prediction.geometry.warping import warped_distance
from hri_sim.policies.evaluation import motions, situations, until

FloatArray = NDArray[np.float64]
Paths = list[FloatArray]


def likeness_table(
    model: PolicyModel,
    learnt: Sequence[Encounter],
    test: Sequence[Encounter],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Rows policy, promp and human: sample, sample_sd, paired, coverage, mean [mm but for coverage].

    Each also has these for forward and backward reaches apart, where there are any.

    Args:
        model: The policy.
        learnt: What it has learnt from; the ProMP learns from the same, shifted to start and goal.
        test: Encounters that neither has learnt from.
        rng: Draws the ProMP's samples, and halves of people.
    """
    found = situations(test)
    made = {
        "policy": policy_paths(model, test, rng),
        "promp": _promp_paths(learnt, test, found.human, rng),
    }
    rows: dict[str, Any] = {name: {} for name in (*made, "human")}
    for direction, which in _directions(found.backward).items():
        human = _some(found.human, which)
        figures = {name: compared(_some(paths, which), human) for name, paths in made.items()}
        for name, one in {**figures, "human": among_people(human, rng)}.items():
            rows[name].update({direction: one} if direction else one)
    return rows


def _directions(backward: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
    """All encounters, and where there are some forward and backward ones."""
    found = {"": np.ones(len(backward), dtype=bool), "forward": ~backward, "backward": backward}
    return {name: which for name, which in found.items() if which.sum() >= 2}


def _some(paths: Paths, which: NDArray[np.bool_]) -> Paths:
    return [path for path, wanted in zip(paths, which, strict=True) if wanted]


def policy_paths(model: PolicyModel, test: Sequence[Encounter], rng: np.random.Generator) -> Paths:
    """Paths that a policy makes in some encounters, until the goal is reached [m]."""
    found = situations(test)
    positions = motions(model, found, 0.0, rng)
    steps = reach_steps(positions, found.goal)
    return [until(p, n) for p, n in zip(positions, steps, strict=True)]


def compared(made: Paths, human: Paths) -> dict[str, float]:
    """Measures of made paths beside human ones, the i-th of both of the same encounter [m]."""
    apart = likeness([1e3 * path for path in made], [1e3 * path for path in human])
    return {**asdict(apart), "mean": mean_distance(made, human)}


def among_people(human: Paths, rng: np.random.Generator) -> dict[str, float | None]:
    """Each path's nearest among the others, and means of two halves; nothing is paired."""
    people = [1e3 * path for path in human]
    apart = distances(people, people)
    np.fill_diagonal(apart, np.inf)
    nearest = apart.min(axis=1)
    order = rng.permutation(len(human))
    half = len(order) // 2
    return {
        "sample": float(nearest.mean()),
        "sample_sd": float(nearest.std()),
        "paired": None,
        "coverage": len(np.unique(apart.argmin(axis=1))) / len(human),
        "mean": mean_distance(
            [human[row] for row in order[:half]], [human[row] for row in order[half:]]
        ),
    }


def mean_distance(made: Sequence[FloatArray], human: Sequence[FloatArray]) -> float:
    """Distance of the mean paths [mm], both as long as human paths are on average.

    Paths are taken from their first position on: so this means something where they lead to several
    goals too, and is the thesis' measure where all lead from one place to one other.
    """
    count = max(round(float(np.mean([len(path) for path in human]))), 2)
    return warped_distance(1e3 * mean_path(made, count), 1e3 * mean_path(human, count))


def mean_path(paths: Sequence[FloatArray], count: int) -> FloatArray:
    """Mean of paths (n_i, 3) over their phase, from their first positions on (count, 3)."""
    return np.mean([at_phases(path - path[0], count) for path in paths], axis=0)


def at_phases(path: FloatArray, count: int) -> FloatArray:
    """A path (n, 3) at so many equally spaced phases (count, 3)."""
    phases, own = np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(path))
    return np.stack([np.interp(phases, own, path[:, axis]) for axis in range(3)], axis=1)


def _promp_paths(
    learnt: Sequence[Encounter],
    test: Sequence[Encounter],
    human: Sequence[FloatArray],
    rng: np.random.Generator,
) -> Paths:
    """A sample of a ProMP for each test encounter [m], laid to its start and goal.

    It is fitted to paths without the straight line from start to goal, and takes as long as the
    recorded path: it is told more than the policy.
    """
    model = path_model([_bow(one.hand, one.hand[0], one.hand[-1]) for one in learnt])
    made = []
    for one, path in zip(test, human, strict=True):
        phases = np.linspace(0.0, 1.0, len(path))
        bow = model.sample(phases, rng)[0]
        made.append(one.hand[0] + phases[:, None] * (one.goal - one.hand[0]) + bow)
    return made


def _bow(path: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    share = np.linspace(0.0, 1.0, len(path))[:, None]
    bow: FloatArray = path - (start + share * (end - start))
    return bow
