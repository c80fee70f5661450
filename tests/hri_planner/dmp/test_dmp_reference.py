"""Motions beside those of movement_primitives (Fabisch), as far as the two coincide.

That is the transformation system and its integration: theirs has another forcing term and no delayed
goal, so both are handed to it.
"""

import numpy as np
import pytest

from hri_planner.dmp.basis import forcing, projected
from hri_planner.dmp.response import response
from hri_planner.dmp.transformation import ALPHA, ALPHA_G, BETA

pytest.importorskip(
    "pytransform3d", reason="movement_primitives' DMPs need it: scripts/setup --dev"
)
from movement_primitives.dmp._dmp import dmp_step_rk4

START, GOAL = np.array((0.4, -0.3, 0.2)), np.array((0.6, 0.3, 0.1))
STEP_S = 5e-4


class Forcing:
    """Ours, as theirs is called; their phase is time here."""

    def __init__(self, weights: np.ndarray, duration: float) -> None:
        self.weights, self.duration = weights, duration

    def phase(self, times: np.ndarray) -> np.ndarray:
        return times - STEP_S  # they take the time after a step for the one before

    def forcing_term(self, times: np.ndarray) -> np.ndarray:
        found = np.zeros((len(times), 3))
        for row, time_s in zip(found, times, strict=True):
            forcing(time_s / self.duration, self.weights, row)
        return ALPHA * BETA * found.T


@pytest.mark.parametrize("duration", [1.5, 2.5])
@pytest.mark.parametrize("sd", [0.0, 0.05])
def test_a_motion_is_that_of_movement_primitives(duration: float, sd: float) -> None:
    """The delayed goal, which theirs does not have, is handed to it as a goal that moves."""
    weights = projected(sd * np.random.default_rng(1).standard_normal((3, 20)))
    term = Forcing(weights, duration)
    place, speed, still = START.copy(), np.zeros(3), np.zeros(3)
    theirs = [place.copy()]
    for step in range(round(duration / STEP_S)):
        # In the middle of a step.
        lag = np.exp(-ALPHA_G * (step + 0.5) * STEP_S / duration)
        dmp_step_rk4(
            step * STEP_S, (step + 1) * STEP_S, place, speed, GOAL + lag * (START - GOAL), still,
            still, START, still, still, duration, 0.0, ALPHA, BETA, term, int_dt=STEP_S,
        )  # fmt: skip
        theirs.append(place.copy())
    ours = response(duration, 0.004)
    path = ours.rollouts(START, GOAL, weights)
    stride = round(0.004 / STEP_S)
    assert np.abs(path - np.array(theirs)[::stride]).max() < 1e-4
