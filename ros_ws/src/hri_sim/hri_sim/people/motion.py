"""One reaching movement of a hand.

The hand follows a straight minimum-jerk path (Flash & Hogan 1985) plus a bump: people lift their
hand over the table (by 17 % of the distance, median of the 200 ADL Vicon reaches; 8-34 % between
the 10th and 90th percentile). Repetitions differ: in end point, with a scatter that grows with the
mean speed (signal-dependent noise, Harris & Wolpert 1998), in duration, in curvature and in the
swivel of the elbow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_sim.people.arm import ArmModel

ENDPOINT_SCATTER = 0.02
"""Standard deviation of the end point on each axis, for a mean speed of 1 m/s [s]."""
DURATION_SPREAD = 0.06
"""Standard deviation of the logarithm of the duration."""
LIFT_SPREAD = 0.35
"""Standard deviation of the lift, as a share of the usual lift."""
SIDEWAYS_SPREAD = 0.04
"""Standard deviation of the sideways bow of the path, as a share of its length."""
SWIVEL_SPREAD = 0.08
"""Standard deviation of the swivel at the end of a reach [rad]."""


def _bump(tau: ArrayLike) -> FloatArray:
    """Zero at both ends with two derivatives, one in the middle."""
    s = np.clip(np.asarray(tau, dtype=float), 0.0, 1.0)
    return 64.0 * (s * (1.0 - s)) ** 3


class Movement(Protocol):
    """What a hand does from one rest to the next; twice continuously differentiable in time."""

    @property
    def start_s(self) -> float:
        """When it begins [s]."""

    @property
    def end_s(self) -> float:
        """When it ends [s]."""

    @property
    def end(self) -> FloatArray:
        """Hand tip at the end (3,) [m]."""

    @property
    def swivel(self) -> tuple[float, float]:
        """Swivel of the elbow at the beginning and at the end [rad]."""

    def sample(self, t_s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Hand tip (..., 3) [m] and swivel (...) [rad] at times (...) [s]; at rest before and after."""


@dataclass(frozen=True, eq=False)
class HandMotion:
    """A planned reach; it is twice continuously differentiable, at rest before and after.

    Attributes:
        start_s: When it begins [s].
        duration: How long it takes [s].
        start: Hand tip at the beginning (3,) [m].
        end: Hand tip at the end (3,) [m].
        bow: Deviation from the straight line half way (3,) [m].
        swivel: Swivel of the elbow at the beginning and at the end [rad].
    """

    start_s: float
    duration: float
    start: FloatArray
    end: FloatArray
    bow: FloatArray
    swivel: tuple[float, float]

    @property
    def end_s(self) -> float:
        """When it ends [s]."""
        return self.start_s + self.duration

    def sample(self, t_s: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Hand tip (..., 3) [m] and swivel (...) [rad] at times (...) [s]."""
        tau = (np.asarray(t_s, dtype=float) - self.start_s) / self.duration
        share = minimum_jerk(tau)
        way = share[..., None] * (self.end - self.start)
        tip = self.start + way + _bump(tau)[..., None] * self.bow
        return tip, self.swivel[0] + share * (self.swivel[1] - self.swivel[0])


def draw_motion(
    arm: ArmModel,
    start: FloatArray,
    target: FloatArray,
    *,
    start_s: float,
    duration: float,
    swivel: tuple[float, float],
    lift: float,
    variability: float,
    rng: np.random.Generator,
) -> HandMotion:
    """Draw one repetition of a reach.

    Args:
        arm: The arm; the motion is kept within its reach.
        start: Hand tip at the beginning (3,) [m].
        target: Where the hand tip is meant to go (3,) [m].
        start_s: When it begins [s].
        duration: Usual duration [s].
        swivel: Swivel at the beginning, and the usual one at the end [rad].
        lift: Usual lift as a share of the distance.
        variability: Factor on all spreads; 0 gives the nominal motion.
        rng: Draws the same number of values whatever the variability.
    """
    noise = variability * rng.standard_normal(7)
    length = float(np.linalg.norm(target - start))
    time = duration * float(np.exp(DURATION_SPREAD * noise[0]))
    scatter = ENDPOINT_SCATTER * length / duration * noise[1:4]
    while not arm.can_reach(target + scatter):
        scatter = 0.5 * scatter if np.abs(scatter).max() > 1e-4 else np.zeros(3)
    up = lift * length * max(0.0, 1.0 + LIFT_SPREAD * noise[4])
    sideways = SIDEWAYS_SPREAD * length * noise[5]
    heading = np.array([target[0] - start[0], target[1] - start[1], 0.0])
    heading /= max(float(np.linalg.norm(heading)), 1e-9)
    bow = np.array([-heading[1] * sideways, heading[0] * sideways, up])
    end = (swivel[0], swivel[1] + SWIVEL_SPREAD * noise[6])
    motion = HandMotion(start_s, time, start, target + scatter, bow, end)
    grid = start_s + time * np.linspace(0.0, 1.0, 21)
    for share in (0.5, 0.25, 0.0):
        if arm.can_reach(motion.sample(grid)[0]):
            break
        motion = HandMotion(start_s, time, start, target + scatter, share * bow, end)
    return motion
