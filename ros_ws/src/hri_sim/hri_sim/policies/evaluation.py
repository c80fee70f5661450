"""A policy against the people it learnt from: the columns of table 5.2, and of table 5.3."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.integration import initial_velocity
from hri_planner.rnn.metrics.divergence import LEAST_PATHS, divergence, human_floor
from hri_planner.rnn.metrics.reaching import Reaching, reach_steps, reaching
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.rollout import roll_out

FloatArray = NDArray[np.float64]

STEPS = 200
"""Of a simulation, 32 ms each (section 5.3.6)."""

NOISE_M = 0.003
"""Standard deviation that is added to goal and partner in the columns with noise: N(0, 9 mm²)."""


@dataclass(frozen=True, eq=False)
class Situations:
    """Test encounters, as policies meet them.

    Attributes:
        start: First positions (n, 3) [m].
        velocity: First velocities (n, 3) [m/s].
        goal: Shape (n, 3) [m].
        partner: As recorded, then held (n, STEPS, 3) [m].
        human: Recorded hands until they reach the goal, and all of those that never do.
        recorded_steps: Reach steps of the recordings (n,).
        backward: Which of them lead back home (n,).
    """

    start: FloatArray
    velocity: FloatArray
    goal: FloatArray
    partner: FloatArray
    human: list[FloatArray]
    recorded_steps: FloatArray
    backward: NDArray[np.bool_]


def situations(encounters: Sequence[Encounter]) -> Situations:
    """Prepare test encounters."""
    partners = np.empty((len(encounters), STEPS, 3))
    steps = np.empty(len(encounters))
    for index, one in enumerate(encounters):
        rows = np.minimum(np.arange(STEPS), len(one) - 1)
        partners[index] = one.partner[rows]
        steps[index] = reach_steps(one.hand, one.goal)
    return Situations(
        start=np.array([one.hand[0] for one in encounters]),
        velocity=np.array([initial_velocity(one.hand, 1.0) for one in encounters]),
        goal=np.array([one.goal for one in encounters]),
        partner=partners,
        human=[until(one.hand, n) for one, n in zip(encounters, steps, strict=True)],
        recorded_steps=steps,
        backward=np.array([one.backward for one in encounters]),
    )


def until(path: FloatArray, step: float) -> FloatArray:
    """A path until it reaches the goal; at least two positions."""
    return path if np.isnan(step) else path[: max(int(step) + 1, 2)]


def motions(
    model: PolicyModel, found: Situations, noise: float, rng: np.random.Generator
) -> FloatArray:
    """Hands as the policy moves them (n, STEPS + 1, 3) [m]."""
    return roll_out(
        model,
        found.start,
        found.goal,
        found.partner,
        velocity=found.velocity / model.dt,
        noise=noise,
        rng=rng,
    ).positions


def evaluate(
    model: PolicyModel, encounters: Sequence[Encounter], rng: np.random.Generator
) -> dict[str, Any]:
    """The columns of table 5.2, with the human floor of the divergences, and the time of a step.

    Args:
        model: The policy.
        encounters: That it has not learnt from.
        rng: Draws noise and the halves of the floor.
    """
    found = situations(encounters)
    exact = _columns(model, found, 0.0, rng)
    return {
        "cell": model.network.kind,
        "units": list(model.network.units),
        "encounters": len(encounters),
        **exact,
        "kl_floor": {
            name: human_floor(paths, rng) if len(paths) >= 2 * LEAST_PATHS else None
            for name, paths in by_direction(found, found.human).items()
        },
        "noise": _columns(model, found, NOISE_M, rng),
        "step_us": step_time_us(model),
    }


def _columns(
    model: PolicyModel, found: Situations, noise: float, rng: np.random.Generator
) -> dict[str, Any]:
    positions = motions(model, found, noise, rng)
    reached = reaching(positions, found.goal, found.recorded_steps, model.dt)
    steps = reach_steps(positions, found.goal)
    made = by_direction(found, [until(p, n) for p, n in zip(positions, steps, strict=True)])
    human = by_direction(found, found.human)
    kl = {
        name: finite(divergence(human[name], made[name]))
        if len(human[name]) >= LEAST_PATHS
        else None
        for name in made
    }
    return {
        "kl_forward": kl["forward"],
        "kl_backward": kl["backward"],
        **reaching_figures(reached),
        **{
            name: reaching_figures(
                reaching(positions[which], found.goal[which], found.recorded_steps[which], model.dt)
            )
            for name, which in (("forward", ~found.backward), ("backward", found.backward))
            if which.any()
        },
    }


def reaching_figures(reached: Reaching) -> dict[str, Any]:
    """Whether, when and how exactly goals are reached, as JSON holds it: it knows no NaN."""
    found: dict[str, Any] = finite(
        {
            "reach_time_mse_s2": reached.reach_time_mse,
            "terminal_mm": {
                "reached_mean": 1e3 * reached.terminal_reached,
                "all_mean": 1e3 * reached.terminal_all,
                "max": 1e3 * reached.terminal_max,
            },
            "reached_share": reached.reached_share,
        }
    )
    return found


def finite(value: Any) -> Any:
    """The same with None for each number that is not finite, however deep."""
    if isinstance(value, dict):
        return {name: finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    if isinstance(value, float):
        return float(value) if np.isfinite(value) else None
    return value


def by_direction(found: Situations, paths: Sequence[FloatArray]) -> dict[str, list[FloatArray]]:
    """Paths from their starts on, forward and backward reaches apart; one or both may be empty."""
    return {
        name: [
            path - begin
            for path, begin, back in zip(paths, found.start, found.backward, strict=True)
            if back == backward
        ]
        for name, backward in (("forward", False), ("backward", True))
    }


def step_time_us(model: PolicyModel, steps: int = 400) -> float:
    """Median time of one step of one policy on this machine [µs]."""
    state = model.network.initial_state()
    hand, goal, partner = np.zeros(3), np.full(3, 0.2), np.array((0.1, 0.0, 0.1))
    taken = np.empty(steps)
    for index in range(steps):
        begin = time.perf_counter()
        _, state = model.accelerate(hand, goal, partner, state)
        taken[index] = time.perf_counter() - begin
    return float(1e6 * np.median(taken))
