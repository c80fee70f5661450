"""Reaches that do not end as they began: another target on the way, or a stop.

Both are twice continuously differentiable, as people's movements are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray
from hri_sim.people.motion import HandMotion, draw_motion
from hri_sim.scenario.schema import PersonSpec

CHANGE = (0.3, 0.5)
"""When people change their mind or stop, as a share of the movement that they set out on."""
BRAKE_S = 0.25
"""How long a hand that stops takes to come to rest [s]."""


@dataclass(frozen=True, eq=False)
class ChangedMind:
    """A movement that is diverted to another target while it is under way.

    The first movement is carried out to its end; from the change on, a second one from the first target
    to the second is added to it (Flash & Henis 1991). Both begin and end without velocity and
    acceleration, so that the sum is twice continuously differentiable.

    Attributes:
        first: To the target that the hand sets out to.
        second: From there to the target that it reaches; begins while the first is under way.
    """

    first: HandMotion
    second: HandMotion

    @property
    def start_s(self) -> float:
        """When it begins [s]."""
        return self.first.start_s

    @property
    def end_s(self) -> float:
        """When it ends [s]."""
        return max(self.first.end_s, self.second.end_s)

    @property
    def duration(self) -> float:
        """From the onset of the first movement to the end of the last [s]."""
        return self.end_s - self.start_s

    @property
    def end(self) -> FloatArray:
        """Hand tip at the end (3,) [m]."""
        return self.second.end

    @property
    def swivel(self) -> tuple[float, float]:
        """Swivel of the elbow at the beginning and at the end [rad]."""
        return _swivels(self.sample([self.start_s, self.end_s])[1])

    def sample(self, t_s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Hand tip (..., 3) [m] and swivel (...) [rad] at times (...) [s]."""
        tip, swivel = self.first.sample(t_s)
        more, turn = self.second.sample(t_s)
        return tip + more - self.second.start, swivel + turn - self.second.swivel[0]


@dataclass(frozen=True, eq=False)
class Stopped:
    """A movement that stops on its way and stays there.

    The path is that of the movement. From ``brake_s`` on the time along it slows down to a stand, by a
    smooth step of its rate.

    Attributes:
        motion: The movement that the hand sets out on.
        brake_s: When it begins to stop [s].
    """

    motion: HandMotion
    brake_s: float

    @property
    def start_s(self) -> float:
        """When it begins [s]."""
        return self.motion.start_s

    @property
    def end_s(self) -> float:
        """When it rests [s]."""
        return self.brake_s + BRAKE_S

    @property
    def end(self) -> FloatArray:
        """Hand tip at the end (3,) [m]."""
        return self.sample(self.end_s)[0]

    @property
    def swivel(self) -> tuple[float, float]:
        """Swivel of the elbow at the beginning and at the end [rad]."""
        return _swivels(self.sample([self.start_s, self.end_s])[1])

    def sample(self, t_s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Hand tip (..., 3) [m] and swivel (...) [rad] at times (...) [s]."""
        time = np.asarray(t_s, dtype=float)
        x = np.clip((time - self.brake_s) / BRAKE_S, 0.0, 1.0)
        # The rate is 1 - 3 x^2 + 2 x^3.
        braking = self.brake_s + BRAKE_S * x * (1.0 + x * x * (-1.0 + 0.5 * x))
        return self.motion.sample(np.where(x > 0.0, braking, time))


def change_mind(
    spec: PersonSpec,
    first: HandMotion,
    target: ArrayLike,
    usual_s: float,
    rng: np.random.Generator,
) -> ChangedMind:
    """Divert a movement to another target, on a way that the arm can go.

    Args:
        spec: Who moves.
        first: The movement that the hand sets out on.
        target: Where the hand tip is meant to go now (3,) [m], within reach.
        usual_s: Usual duration of the second movement [s].
        rng: Draws when, and the repetition.
    """
    second = draw_motion(
        spec.arm,
        first.end,
        np.array(target, dtype=float),
        start_s=first.start_s + float(rng.uniform(*CHANGE)) * first.duration,
        duration=usual_s,
        swivel=(first.swivel[1], spec.swivel),
        lift=0.0,
        variability=spec.variability,
        rng=rng,
    )
    for share in (1.0, 0.5, 0.25, 0.0):
        changed = ChangedMind(replace(first, bow=share * first.bow), second)
        grid = first.start_s + changed.duration * np.linspace(0.0, 1.0, 41)
        if spec.arm.can_reach(changed.sample(grid)[0]):
            break
    return changed


def stop_midway(motion: HandMotion, rng: np.random.Generator) -> Stopped:
    """Let a movement stop on its way.

    Args:
        motion: The movement that the hand sets out on.
        rng: Draws when.
    """
    return Stopped(motion, motion.start_s + float(rng.uniform(*CHANGE)) * motion.duration)


def _swivels(values: FloatArray) -> tuple[float, float]:
    return float(values[0]), float(values[1])
