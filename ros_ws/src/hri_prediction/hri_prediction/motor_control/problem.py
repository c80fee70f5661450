"""A reach as an optimal control problem has it: where it begins and ends, how fast, how long it takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError
from hri_prediction.motor_control.arm_model import ANATOMICAL, JointLimits

Array = NDArray[np.float64]

REST = (0.0, 0.0, 0.0)
_SHORTEST_RAD = 1e-4
_TOLERANCE_RAD = 1e-9


@dataclass(frozen=True, eq=False)
class ReachProblem:
    """Boundary conditions of one reach (thesis eq. 2.5).

    Attributes:
        q_start: Joint angles at its begin (3,) [rad]. Copied, read-only, like all arrays here.
        q_end: At its end.
        duration: [s].
        v_start: Joint velocities at its begin (3,) [rad/s].
        v_end: At its end.
        a_start: Joint accelerations at its begin (3,) [rad/s^2]; none: left to the optimum.
        a_end: At its end.

    Raises:
        DataError: when something is not finite, the duration is not positive, or nothing moves.
    """

    q_start: Array
    q_end: Array
    duration: float
    v_start: Array
    v_end: Array
    a_start: Array | None
    a_end: Array | None

    def __post_init__(self) -> None:
        for name in ("q_start", "q_end", "v_start", "v_end", "a_start", "a_end"):
            value = getattr(self, name)
            if value is None and name in ("a_start", "a_end"):
                continue
            array = np.array(value, dtype=float)
            if array.shape != (3,):
                raise DataError(f"{name} has shape {array.shape}", expected="(3,), one a joint")
            if not np.isfinite(array).all():
                raise DataError(f"{name} = {array.tolist()}", expected="three finite numbers")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not (math.isfinite(self.duration) and self.duration > 0.0):
            raise DataError(f"duration {self.duration!r} s", expected="a positive time")
        object.__setattr__(self, "duration", float(self.duration))
        if np.abs(self.q_end - self.q_start).max() < _SHORTEST_RAD:
            raise DataError(
                "the reach has no length: all joint angles end where they begin",
                expected=f"a joint that turns by {_SHORTEST_RAD} rad or more",
            )

    @staticmethod
    def at_rest(q_start: ArrayLike, q_end: ArrayLike, duration: float) -> ReachProblem:
        """One that begins and ends at rest, without velocity and acceleration."""
        rest = np.zeros(3)
        return ReachProblem(
            np.asarray(q_start), np.asarray(q_end), duration, rest, rest, rest, rest
        )

    @staticmethod
    def moving(
        q_start: ArrayLike, q_end: ArrayLike, duration: float, v_start: ArrayLike, v_end: ArrayLike
    ) -> ReachProblem:
        """One that was cut out of a motion: velocities as observed, accelerations left to the optimum."""
        return ReachProblem(
            np.asarray(q_start),
            np.asarray(q_end),
            duration,
            np.asarray(v_start),
            np.asarray(v_end),
            None,
            None,
        )

    def check_limits(self, limits: JointLimits = ANATOMICAL) -> None:
        """Whether it begins and ends where the joints can be.

        Raises:
            DataError: naming the joint that cannot, and how far it can go.
        """
        for name, angles in (("begins", self.q_start), ("ends", self.q_end)):
            for joint in range(3):
                low, high = limits.lower[joint], limits.upper[joint]
                if not low - _TOLERANCE_RAD <= angles[joint] <= high + _TOLERANCE_RAD:
                    raise DataError(
                        f"the reach {name} with q{joint + 1} = {math.degrees(angles[joint]):.1f} deg",
                        expected=f"{math.degrees(low):.0f} to {math.degrees(high):.0f} deg",
                    )
