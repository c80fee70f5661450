"""Closed loops of a policy with simulated partners, who answer to the hand that the policy moves.

Both start at rest. A partner's hand is the quadratic B-spline of the positions that its law of motion
gives every 4 ms: so it has a position, a velocity, and an acceleration that is constant for each 4 ms,
which is what a bound on its acceleration is about.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.model import PolicyModel
from hri_sim.dyads.drawing import draw_reaches
from hri_sim.dyads.hands import STEP_S, Reaches, moving
from hri_sim.dyads.setups import DyadSetup
from hri_sim.policies.filtered import GoalNoise, Hands

FloatArray = NDArray[np.float64]

SECONDS = 7.0
"""200 steps of a policy after the latest onset."""
Arm = Callable[[FloatArray], FloatArray]
"""From hands (n, 3) [m] to the joints of their arms, hands last (n, m, 3) [m]."""

_CHASE_STIFFNESS, _CHASE_DAMPING = 40.0, 8.0


@dataclass(frozen=True, eq=False)
class Meetings:
    """What came of n encounters.

    Attributes:
        hand: Hands that the policy moved, at its time step (n, steps, 3) [m].
        partner: Their partners' (n, steps, 3) [m].
        nearest: Smallest distance of the hand from the partner's, or its arm's axes (n,) [m].
        filtered: Share of the time in which the filter changed what the policy wanted (n,).
        partner_acceleration: Largest of the partner's hand, or any joint of the arm (n,) [m/s²].
    """

    hand: FloatArray
    partner: FloatArray
    nearest: FloatArray
    filtered: FloatArray
    partner_acceleration: FloatArray


def _hand_alone(hands: FloatArray) -> FloatArray:
    return hands[:, None]


def distances(joints: FloatArray, points: FloatArray) -> FloatArray:
    """Of points (n, 3) from the axes of arms, or single joints (n, m, 3) [m]."""
    if joints.shape[1] == 1:
        return np.asarray(np.linalg.norm(joints[:, 0] - points, axis=1))
    begin, limb = joints[:, :-1], np.diff(joints, axis=1)
    along = np.sum((points[:, None] - begin) * limb, axis=2)
    share = np.clip(along / np.maximum(np.sum(limb**2, axis=2), 1e-12), 0.0, 1.0)
    nearest = begin + share[..., None] * limb
    return np.asarray(np.linalg.norm(nearest - points[:, None], axis=2).min(axis=1))


def joined(parts: Sequence[Any]) -> Any:
    """Arrays of several :class:`.Reaches` or :class:`Meetings`, one behind the other."""
    kind = type(parts[0])
    return kind(
        **{
            one.name: np.concatenate([getattr(part, one.name) for part in parts])
            for one in fields(kind)
        }
    )


def taken(reaches: Reaches, rows: NDArray[Any]) -> Reaches:
    """Some of them."""
    return Reaches(**{one.name: getattr(reaches, one.name)[rows] for one in fields(Reaches)})


def draw_many(setups: Sequence[DyadSetup], count: int, rng: np.random.Generator) -> Reaches:
    """Reaches in each of some setups, two people for each of them."""
    found: Reaches = joined([draw_reaches(setup, count, rng) for setup in setups])
    return found


def meet(
    model: PolicyModel,
    reaches: Reaches,
    rng: np.random.Generator,
    *,
    separation: SeparationConfig | None = None,
    noise: GoalNoise | None = None,
    arm: Arm | None = None,
) -> Meetings:
    """Let a policy take the learner's place.

    Until the learner's onset the hand rests, but for what the filter does.

    Args:
        model: The policy.
        reaches: What both want; the partner follows its law.
        rng: Draws the noise of the partner's muscles.
        separation: Parameters of the filter; none: without it.
        noise: Of what the policy sees.
        arm: Of the partners, which the filter keeps clear of; none: it is of their hands alone.
    """
    hands = Hands(model, separation, reaches.start[:, 0], reaches.goal[:, 0], STEP_S, noise)
    watch = _Watch(hands, reaches.onset[:, 0], round(model.dt / STEP_S), arm or _hand_alone)
    for _ in moving(reaches, SECONDS, rng, watch.step):
        pass
    return watch.found()


def chased(
    model: PolicyModel,
    reaches: Reaches,
    separation: SeparationConfig | None,
    fastest: float,
    acceleration: float,
) -> Meetings:
    """Partners who go for the hand that the policy moves, wherever it goes.

    Args:
        model: The policy.
        reaches: Where both begin, and where the policy's hand is to go.
        separation: Parameters of the filter; none: without it.
        fastest: Largest speed of the partner [m/s].
        acceleration: Largest acceleration of the partner [m/s²].
    """
    hands = Hands(model, separation, reaches.start[:, 0], reaches.goal[:, 0], STEP_S)
    watch = _Watch(hands, np.zeros(len(reaches)), round(model.dt / STEP_S), _hand_alone)
    place = reaches.start[:, 1].copy()
    speed = np.zeros_like(place)
    for step in range(round(SECONDS / STEP_S) + 1):
        watch.step(step, place)
        pull = _CHASE_STIFFNESS * (hands.position - place)
        pull += _CHASE_DAMPING * (hands.velocity - speed)
        wanted = speed + _cut(pull, acceleration) * STEP_S
        # Both bounds are convex sets that hold the present velocity: so does their intersection.
        speed = speed + _cut(_cut(wanted, fastest) - speed, acceleration * STEP_S)
        place = place + speed * STEP_S
    return watch.found()


def _cut(vectors: FloatArray, longest: float) -> FloatArray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    cut: FloatArray = vectors * np.minimum(1.0, longest / np.maximum(length, 1e-300))
    return cut


class _Watch:
    """Moves hands beside partners, and keeps account."""

    def __init__(self, hands: Hands, onset: FloatArray, per_step: int, arm: Arm) -> None:
        self._arm = arm
        self._hands, self._onset, self._per_step = hands, onset, per_step
        n = len(onset)
        self._paths: list[tuple[FloatArray, FloatArray]] = []
        self._nearest = np.full(n, np.inf)
        self._filtered = np.zeros(n)
        self._steps = 0
        self._last: FloatArray | None = None
        self._last_speed: FloatArray | None = None
        self._fiercest = np.zeros(n)

    def step(self, step: int, control: FloatArray) -> FloatArray:
        """Where the hands are at a step, given the partners' next control points (n, 3) [m]."""
        joints = self._arm(control)
        last = joints if self._last is None else self._last
        place, speed = 0.5 * (last + joints), (joints - last) / STEP_S
        if self._last_speed is not None:
            change = np.linalg.norm(speed - self._last_speed, axis=2).max(axis=1) / STEP_S
            self._fiercest = np.maximum(self._fiercest, change)
        self._last, self._last_speed = joints.copy(), speed
        hand = self._hands.position
        self._nearest = np.minimum(self._nearest, distances(place, hand))
        if step % self._per_step == 0:
            self._paths.append((hand, place[:, -1]))
        self._hands.step(place, speed, step * STEP_S >= self._onset - 1e-9)
        self._filtered += self._hands.filtered
        self._steps += 1
        return hand

    def found(self) -> Meetings:
        hands, partners = zip(*self._paths, strict=True)
        return Meetings(
            np.stack(hands, axis=1),
            np.stack(partners, axis=1),
            self._nearest,
            self._filtered / self._steps,
            self._fiercest,
        )
