"""What the controller's reference never must do: jump, pass a joint limit, or be no number."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_prediction.ros.messages import ControllerState
from hri_sim.reliability.fault import Figure

FloatArray = NDArray[np.float64]

JUMP = Figure("jump_rad", "largest jump of the reference", "rad", 0.002, digits=4)
"""By so much plans may be off where they take over."""
BEYOND = Figure("beyond", "references beyond a joint limit, or no numbers", limit=0.0)
NEXT_S = 0.006
"""References that are farther apart do not follow each other, at 250 Hz [s]."""


class Asked(NamedTuple):
    """A reference.

    Attributes:
        stamp_s: Of when it is [s].
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
    """

    stamp_s: float
    q: FloatArray
    qd: FloatArray

    @classmethod
    def of(cls, message: ControllerState, stamp_s: float) -> Asked:
        """That of a message, at a time [s]."""
        return cls(
            stamp_s, np.array(message.reference_position), np.array(message.reference_velocity)
        )


def on_course(asked: Sequence[Asked], robot: RobotModel) -> dict[str, float | None]:
    """Figures :data:`JUMP` and :data:`BEYOND`; none where nothing was heard that they could be told by.

    A jump is what a step has beyond the way at the mean speed of its two references.

    Args:
        asked: In the order in which they were heard; a step counts where the stamps are 4 ms apart.
        robot: Has the limits.
    """
    jumps = []
    for before, after in itertools.pairwise(asked):
        seconds = after.stamp_s - before.stamp_s
        if 0.0 < seconds < NEXT_S:
            way = 0.5 * (before.qd + after.qd) * seconds
            jumps.append(float(np.abs(after.q - before.q - way).max()))
    inside = [np.isfinite(one.qd).all() and robot.within_limits(one.q) for one in asked]
    return {
        JUMP.key: max(jumps, default=None),
        BEYOND.key: float(len(inside) - sum(inside)) if inside else None,
    }


def worse(
    one: Mapping[str, float | None], other: Mapping[str, float | None]
) -> dict[str, float | None]:
    """The larger of two values of each figure; none where either is none."""
    found: dict[str, float | None] = {}
    for key, value in one.items():
        beside = other[key]
        found[key] = None if value is None or beside is None else max(value, beside)
    return found
