"""How two hands move that reach through the same space, each giving way to the other.

Each hand is brought to its goal by the feedback law of minimum jerk (Hoff & Arbib 1993): with the
remaining time D, distance e to the goal, velocity v and acceleration a,

    jerk = -60 e / D³ - 36 v / D² - 9 a / D,

undisturbed a minimum-jerk reach. The partner's hand pushes the hand aside, a little upwards more than
away, and holds the remaining time up, by where it seemed a reaction time ago that both would be
nearest. Muscles follow accelerations late and with noise in proportion to them (Harris & Wolpert 1998).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STEP_S = 0.004
LAWS = ("push", "sidestep", "none", "hesitate")
"""How a hand answers the other: away from it, as training data do; to the right of the line of
approach; not at all; by stopping until the other is gone."""

_LEAST_LEFT_S = 0.22
_REACH_OF_PARTNER_M = 0.40
_NEAREST_M = 0.06
_MUSCLE_S = 0.06
_FORESIGHT_S = 0.35
_HESITATES_M = 0.20
_STOP_S = 0.30
_UP = np.array((0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Reaches:
    """n pairs of reaches; of arrays with two columns the first is the learner's, the second the partner's.

    Attributes:
        start: Hands before (n, 2, 3) [m].
        goal: Where they go (n, 2, 3) [m].
        onset: When they set off (n, 2) [s].
        duration: How long they would take undisturbed (n, 2) [s].
        lift: Height of the path over the straight line, as a share of its length (n, 2).
        gain: Of the push (n, 2) [m²/s²].
        patience: How much the other's nearness slows a hand down (n, 2), 0 to 1.
        delay: Reaction time (n, 2) [s].
        noise: Of accelerations, relative (n, 2).
        law: Index in :data:`LAWS` (n, 2).
        bow: How far the middle of the path is aside of the straight line, besides the lift (n, 2, 3) [m].
    """

    start: FloatArray
    goal: FloatArray
    onset: FloatArray
    duration: FloatArray
    lift: FloatArray
    gain: FloatArray
    patience: FloatArray
    delay: FloatArray
    noise: FloatArray
    law: NDArray[np.int64]
    bow: FloatArray

    def __len__(self) -> int:
        """Number of pairs."""
        return len(self.start)

    def with_partner(self, law: str) -> Reaches:
        """The same with another law of the partner's."""
        laws = self.law.copy()
        laws[:, 1] = LAWS.index(law)
        return replace(self, law=laws)


def simulate(reaches: Reaches, seconds: float, rng: np.random.Generator) -> FloatArray:
    """Hands over time.

    Args:
        reaches: What they do.
        seconds: How long.
        rng: Draws the noise of the muscles.

    Returns:
        Positions at 250 Hz (n, steps, 2, 3) [m].
    """
    return np.stack(list(moving(reaches, seconds, rng)), axis=1)


def moving(
    reaches: Reaches,
    seconds: float,
    rng: np.random.Generator,
    learner: Callable[[int, FloatArray], FloatArray] | None = None,
) -> Iterator[FloatArray]:
    """The same as it happens: positions (n, 2, 3) [m], step by step.

    Args:
        reaches: What they do.
        seconds: How long.
        rng: Draws the noise of the muscles.
        learner: Moves the learners' hands instead: told the step and the partners' hands (n, 3) [m]
            it gives theirs (n, 3) [m], which the partners answer.
    """
    n, steps = len(reaches), round(seconds / STEP_S) + 1
    length = np.linalg.norm(reaches.goal - reaches.start, axis=2)
    lift = (reaches.lift * length)[..., None] * _UP + reaches.bow
    y, v = reaches.start.copy(), np.zeros((n, 2, 3))
    a, aside, shake = np.zeros((n, 2, 3)), np.zeros((n, 2, 3)), np.zeros((n, 2, 3))
    left = reaches.duration.copy()
    late = np.maximum(np.rint(reaches.delay / STEP_S).astype(int), 1)
    found = np.empty((n, steps, 2, 3))
    rows, columns = np.arange(n)[:, None], np.arange(2)[None]
    laws = _laws(reaches)
    for step in range(steps):
        gone = np.clip(1.0 - left / reaches.duration, 0.0, 1.0)
        bump = 64.0 * (gone * (1.0 - gone)) ** 3
        found[:, step] = y + bump[..., None] * lift
        if learner is not None:
            found[:, step, 0] = learner(step, found[:, step, 1])
        yield found[:, step].copy()
        then = np.maximum(step - late, 0)
        before = np.maximum(then - 1, 0)
        away = found[rows, then, columns] - found[rows, then, 1 - columns]
        drift = (away - found[rows, before, columns] + found[rows, before, 1 - columns]) / STEP_S
        answer = _answer(laws, away, drift, v)
        begun = (step * STEP_S >= reaches.onset)[..., None]
        aside += (answer.aside - aside) * (STEP_S / _MUSCLE_S)
        shake += -shake * (STEP_S / _MUSCLE_S) + rng.standard_normal((n, 2, 3)) * np.sqrt(
            2.0 * STEP_S / _MUSCLE_S
        )
        waits = answer.waits[..., None]
        remaining = np.where(waits, _STOP_S, np.maximum(left, _LEAST_LEFT_S)[..., None])
        way = np.where(waits, 0.0, reaches.goal - y)
        jerk = 60.0 * way / remaining**3 - 36.0 * v / remaining**2 - 9.0 * a / remaining
        a += np.where(begun, jerk * STEP_S, 0.0)
        total = a + aside
        total += reaches.noise[..., None] * np.linalg.norm(total, axis=2, keepdims=True) * shake
        v += np.where(begun, total * STEP_S, 0.0)
        y += v * STEP_S
        slowed = np.where(answer.waits, 0.0, 1.0 - reaches.patience * answer.nearness)
        left = np.where(begun[..., 0], np.maximum(left - slowed * STEP_S, 0.0), left)


@dataclass(frozen=True, eq=False)
class _Laws:
    """Who answers how.

    Attributes:
        gain: Of pushes, 0 where there are none (n, 2) [m²/s²].
        sidesteps: Who gives way to the right (n, 2).
        hesitates: Who stops (n, 2).
        blind: Who does not care (n, 2).
    """

    gain: FloatArray
    sidesteps: NDArray[np.bool_]
    hesitates: NDArray[np.bool_]
    blind: NDArray[np.bool_]


def _laws(reaches: Reaches) -> _Laws:
    push, sidestep, none, hesitate = (reaches.law == index for index in range(len(LAWS)))
    return _Laws(reaches.gain * (push | sidestep), sidestep, hesitate, none)


@dataclass(frozen=True, eq=False)
class _Answer:
    """What each hand makes of the other.

    Attributes:
        nearness: How near it will be (n, 2), 0 to 1.
        aside: Acceleration out of its way (n, 2, 3) [m/s²].
        waits: Whether it stops until the other is gone (n, 2).
    """

    nearness: FloatArray
    aside: FloatArray
    waits: NDArray[np.bool_]


def _answer(laws: _Laws, away: FloatArray, drift: FloatArray, velocity: FloatArray) -> _Answer:
    """How hands answer.

    People foresee where others will be: what counts is the offset at the closest moment of the next
    third of a second, if both go on as they do.

    Args:
        laws: Who answers how.
        away: Own hand minus the other's, as it was seen (n, 2, 3) [m].
        drift: How that changes (n, 2, 3) [m/s].
        velocity: Of the own hand (n, 2, 3) [m/s].
    """
    squares = np.einsum("npi,npi->np", drift, drift)
    closing = -np.einsum("npi,npi->np", away, drift)
    until = np.clip(closing / np.maximum(squares, 1e-9), 0.0, _FORESIGHT_S)
    offset = away + until[..., None] * drift
    distance = np.maximum(np.linalg.norm(offset, axis=2), _NEAREST_M)
    felt = np.maximum(1.0 / distance - 1.0 / _REACH_OF_PARTNER_M, 0.0)
    nearness = np.clip(felt / (1.0 / _NEAREST_M - 1.0 / _REACH_OF_PARTNER_M), 0.0, 1.0)
    direction = offset / distance[..., None] + 0.4 * _UP
    seen = away / np.maximum(np.linalg.norm(away, axis=2), _NEAREST_M)[..., None]
    ahead = -np.einsum("npi,npi->np", velocity, seen)
    if laws.sidesteps.any():
        turn = (ahead > 0.0)[..., None] * np.cross(seen, _UP)
        direction = np.where(laws.sidesteps[..., None], turn, direction)
    return _Answer(
        nearness=np.where(laws.blind, 0.0, nearness),
        aside=(laws.gain * felt)[..., None] * direction,
        waits=laws.hesitates & (distance < _HESITATES_M) & (ahead > -0.02),
    )
