"""First guesses of a reach, to be compared: what each expects before anything is seen of a person."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.hybrid.person import SeenReach
from hri_prediction.hybrid.prior_path import (
    POINTS,
    Geometry,
    PriorPath,
    optimal_path,
    straight_path,
)
from hri_prediction.hybrid.task import PersonalTask, TaskKey, TaskRules
from hri_prediction.hybrid.weight_process import WeightProcess, to_alpha

Array = NDArray[np.float64]

OPTIMAL, STRAIGHT, OTHERS, WIDE = "optimal control", "straight line", "other people", "wide"
USUAL = "optimal control, usual weights"
"""The same weights for every reach, the mean of the process: what knowing the posture adds to it."""
GUESSES = (OPTIMAL, USUAL, STRAIGHT, OTHERS, WIDE)
_PHASES = np.linspace(0.0, 1.0, POINTS)


@dataclass(frozen=True, eq=False)
class Guess:
    """A task as it begins, and the rules by which it is updated."""

    rules: TaskRules
    task: PersonalTask


def wide_rules(rules: TaskRules) -> TaskRules:
    """Rules of somebody who knows where the hand is, and nothing else."""
    config = rules.config
    wide = replace(config, offset_sd=0.05, drift_sd=0.35, scale_sd=0.0, detour_sd=0.05)
    return TaskRules(rules.predictor, wide, rules.settings.costs)


def other_guesses(
    rules: TaskRules,
    optimal: PersonalTask,
    people: WeightProcess,
    reach: SeenReach,
    geometry: Geometry,
    others: Sequence[Array],
    duration_s: float,
) -> Mapping[str, Guess]:
    """All first guesses but that of optimal control.

    Args:
        rules: Of the hybrid.
        optimal: The task as optimal control begins it.
        people: Which weights are expected of anybody.
        reach: One of the person's, for the arm alone.
        geometry: What the reach is between.
        others: Mean paths of other people to the same target (POINTS, 6) [m].
        duration_s: Expected, from rest to rest.
    """
    onset = rules.predictor.onset_speed
    usual = optimal_path(
        reach.body, geometry, duration_s, to_alpha(people.mean, people.names), people.names, onset
    )
    straight = straight_path(reach.body, geometry, duration_s, onset)
    still = replace(optimal.path, phases=_PHASES, values=np.tile(geometry.start, (POINTS, 1)))
    # Others' paths, moved to where this arm begins.
    mean = np.mean(others, axis=0)
    elsewhere = replace(
        optimal.path, phases=np.linspace(0.0, 1.0, len(mean)), values=_begun_at(mean, geometry)
    )
    key: TaskKey = optimal.key
    wide = wide_rules(rules)

    def begun(by: TaskRules, path: PriorPath) -> Guess:
        return Guess(by, by.begin(key, optimal.alpha, geometry, path))

    return {
        USUAL: begun(rules, usual),
        STRAIGHT: begun(rules, straight),
        OTHERS: begun(rules, elsewhere),
        WIDE: begun(wide, still),
    }


def _begun_at(path: Array, geometry: Geometry) -> Array:
    """A path that is moved, at its begin wholly and at its end not at all, to begin where an arm rests."""
    steps = np.linalg.norm(np.diff(path[:, 3:], axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    fade = 1.0 - gone / max(float(gone[-1]), 1e-9)
    found: Array = path + fade[:, None] * (geometry.start - path[0])
    return found
