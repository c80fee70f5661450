"""A policy beside partners who give way otherwise than those that it has learnt from.

Partner and policy answer each other: nothing is replayed. Beside it stand people in the same
situations: the learner of the simulated dyad, who gives way as in training data.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.rnn.metrics.reaching import reach_steps, reaching
from hri_planner.rnn.model import PolicyModel
from hri_sim.dyads.hands import LAWS, STEP_S, Reaches, simulate
from hri_sim.dyads.setups import draw_setups
from hri_sim.policies.evaluation import NOISE_M, reaching_figures
from hri_sim.policies.filtered import GoalNoise
from hri_sim.policies.meetings import SECONDS, draw_many, meet

SETUPS = 12
NEAR_M = 0.10
"""Hands nearer than this count as near."""
_STREAM = 5


def beside_partners(model: PolicyModel, seed: int, count: int) -> dict[str, Any]:
    """Figures by the partner's law, see :data:`.LAWS`; the first is that of training data.

    Args:
        model: The policy.
        seed: Of setups, people and noise.
        count: Encounters in each of twelve setups.
    """
    rng = np.random.default_rng((seed, _STREAM))
    reaches = draw_many(draw_setups(SETUPS, rng), count, rng)
    return {law: _beside(model, reaches.with_partner(law), seed) for law in LAWS}


def _beside(model: PolicyModel, reaches: Reaches, seed: int) -> dict[str, Any]:
    def again() -> np.random.Generator:
        return np.random.default_rng((seed, _STREAM, 1))

    every = round(model.dt / STEP_S)
    both = simulate(reaches, SECONDS, again())
    human = both[:, ::every, 0]
    goal = reaches.goal[:, 0]
    recorded = reach_steps(human, goal)
    exact = meet(model, reaches, again())
    noisy = meet(model, reaches, again(), noise=GoalNoise(NOISE_M, seed))
    apart = np.linalg.norm(both[:, :, 0] - both[:, :, 1], axis=2).min(axis=1)
    return {
        "encounters": len(reaches),
        **reaching_figures(reaching(exact.hand, goal, recorded, model.dt)),
        **_nearness(exact.nearest),
        "noise": {
            **reaching_figures(reaching(noisy.hand, goal, recorded, model.dt)),
            **_nearness(noisy.nearest),
        },
        "human": {
            **reaching_figures(reaching(human, goal, recorded, model.dt)),
            **_nearness(apart),
        },
    }


def _nearness(nearest: np.ndarray) -> dict[str, float]:
    return {
        "nearest_median_mm": float(1e3 * np.median(nearest)),
        "near_share": float(np.mean(nearest < NEAR_M)),
    }
