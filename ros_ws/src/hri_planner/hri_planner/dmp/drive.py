"""What a movement primitive wants of the tool at each control step, wherever that has got to: compiled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.basis import BASIS_COUNT, forcing, projected
from hri_planner.dmp.potential_field import FieldConfig, push
from hri_planner.dmp.transformation import ALPHA, BETA, Gains, next_rate, step_gains
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

MEMORY = 4
"""Numbers that a motion remembers: its phase, and where the delayed goal is."""


@dataclass(frozen=True, eq=False)
class Drive:
    """A motion by a movement primitive.

    Attributes:
        goal: Where it ends (3,) [m], base frame.
        duration: tau [s].
        weights: Shape (3, k) [m], projected.
        field: Parameters of the potential field.
    """

    goal: FloatArray
    duration: float
    weights: FloatArray
    field: FieldConfig

    @staticmethod
    def of(goal: FloatArray, duration: float, weights: FloatArray, field: FieldConfig) -> Drive:
        """Of weights (3, k) [m] as they are learnt."""
        return Drive(np.array(goal, dtype=float), duration, projected(weights), field)

    def constants(self, dt: float) -> tuple[Any, ...]:
        """What :func:`drive_acceleration` wants to know; ``dt`` is the control period [s]."""
        field = (self.field.strength, self.field.exponent, self.field.nearest)
        phase_step = dt / self.duration
        return (True, self.goal, self.weights, step_gains(phase_step), self.duration, dt, field)


def begin(position: FloatArray) -> FloatArray:
    """Memory (4,) of a motion that begins at a position (3,) [m]."""
    return np.array((0.0, *position))


def settled(goal: FloatArray) -> FloatArray:
    """Memory (4,) of a motion that is over, and rests at its goal (3,) [m]."""
    return np.array((1.0, *goal))


_GAINS: Gains = (0.0, 0.0, 0.0, 0.0, 0.0)
NO_DRIVE = (False, np.zeros(3), np.zeros((3, BASIS_COUNT)), _GAINS, 1.0, 1.0, (0.0, 2.0, 1.0))
"""Stands where there is none."""


@njit
def drive_acceleration(
    position: Any,
    velocity: Any,
    memory: Any,
    drive: Any,
    axes: Any,
    speeds: Any,
    radii: Any,
    boxes: Any,
    margin: float,
    wanted: Any,
) -> None:
    """Acceleration of the next control step; the memory goes a step on.

    Args:
        position: Of the tool (3,) [m].
        velocity: Of the tool (3,) [m/s].
        memory: Phase and delayed goal (4,), changed in place.
        drive: Of :meth:`Drive.constants`.
        axes: Of :class:`hri_planner.dmp.potential_field.Obstacles`, as the next four.
        speeds: As there.
        radii: As there.
        boxes: As there.
        margin: As there.
        wanted: Result (3,) [m/s²].
    """
    _, goal, weights, gains, duration, dt, field = drive
    driven, aside = np.empty(3), np.zeros(3)
    forcing(memory[0] + 0.5 * dt / duration, weights, driven)
    if field[0] > 0.0:
        push(position, velocity, axes, speeds, radii, boxes, margin, field, aside)
    for k in range(3):
        lag = memory[1 + k] - goal[k]
        force = ALPHA * BETA * driven[k] + duration * duration * aside[k]
        rate = next_rate(position[k] - goal[k], duration * velocity[k], lag, force, gains)
        wanted[k] = (rate / duration - velocity[k]) / dt
        memory[1 + k] = goal[k] + gains[4] * lag
    memory[0] += dt / duration
