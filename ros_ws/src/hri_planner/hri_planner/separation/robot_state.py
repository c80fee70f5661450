"""How a robot moves, as the separation monitor knows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEAST_RATE = 0.01
"""At a lower rate the reference's speed says nothing of what it would be at full rate."""
MAX_APART_S = 0.02
"""Joint states and reference that are farther apart are not of the same motion [s]."""


@dataclass(frozen=True, eq=False)
class RobotState:
    """How the robot moves.

    Attributes:
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
        age_s: How long ago they were measured [s].
        rate: At which it follows its path now, 0...1.
        path_qd: Joint speeds of the path now, at full rate (7,) [rad/s]; none: not known.
    """

    q: FloatArray
    qd: FloatArray
    age_s: float
    rate: float
    path_qd: FloatArray | None = None

    @classmethod
    def following(
        cls,
        q: FloatArray,
        qd: FloatArray,
        age_s: float,
        rate: float,
        qd_ref: FloatArray,
        apart_s: float = 0.0,
    ) -> RobotState:
        """One that follows a reference.

        Args:
            q: Joint angles (7,) [rad].
            qd: Measured joint speeds (7,) [rad/s].
            age_s: How long ago these were [s].
            rate: At which it goes along its path, of full speed.
            qd_ref: Joint speeds of the reference at that rate (7,) [rad/s].
            apart_s: By how much reference and joints are of different times [s]. When that is more than
                :data:`MAX_APART_S`, the rate may be another by now: then neither it nor the path is known,
                and the robot is taken to set out as fast as any does.
        """
        if apart_s > MAX_APART_S:
            return cls(q, qd, age_s, 0.0)
        return cls(q, qd, age_s, rate, qd_ref / rate if rate >= LEAST_RATE else None)
