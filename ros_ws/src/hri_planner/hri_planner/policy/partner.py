"""What is known of a partner: the hand, which policies see, and the arm behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.separation import Places
from hri_prediction.compiled import njit
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Partner:
    """A partner's hand, and arm.

    Attributes:
        position: Of the hand (3,) [m].
        velocity: Of the hand (3,) [m/s].
        age: For how long that has been extrapolated [s].
        joints: Ends of the limbs up to the hand (n, 3), n >= 2 [m]; none: the hand is all there is.
        speeds: Velocities of these (n, 3) [m/s].
    """

    position: FloatArray
    velocity: FloatArray
    age: float = 0.0
    joints: FloatArray | None = None
    speeds: FloatArray | None = None

    def check(self) -> None:
        """Check the values.

        Raises:
            DataError: when one is not finite.
        """
        for values in (self.position, self.velocity, self.joints, self.speeds):
            if values is not None and not np.isfinite(values).all():
                raise DataError("a partner is not finite", expected="metres and m/s, or none")

    def later(self, seconds: float) -> Partner:
        """Where all is so much later if it goes on as it does."""
        joints = self.joints
        if joints is not None and self.speeds is not None:
            joints = joints + seconds * self.speeds
        return replace(
            self,
            position=self.position + seconds * self.velocity,
            joints=joints,
            age=self.age + seconds,
        )

    def places(self, point: FloatArray) -> Places:
        """What a hand at a point (3,) [m] keeps clear of: all joints, and on each limb what is nearest."""
        if self.joints is None or self.speeds is None:
            place, speed = self.position[None], self.velocity[None]
        else:
            place, speed = places_of(self.joints, self.speeds, point)
        return Places(place, speed, np.full(len(place), max(self.age, 0.0)))

    def nearest(self, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The place on the limbs' axes next to a point (3,) [m], and its velocity, both (3,)."""
        if self.joints is None or self.speeds is None:
            return self.position, self.velocity
        index, share = _nearest(self.joints, point)
        return (
            (1.0 - share) * self.joints[index] + share * self.joints[index + 1],
            (1.0 - share) * self.speeds[index] + share * self.speeds[index + 1],
        )

    def distance(self, point: FloatArray) -> float:
        """Of a point (3,) from the limbs' axes [m]."""
        return float(np.linalg.norm(self.nearest(point)[0] - point))


@njit
def places_of(joints: Any, speeds: Any, point: Any) -> tuple[Any, Any]:
    """Joints (n), and where limbs (n - 1) are next to a point, with their velocities."""
    count = len(joints)
    place, speed = np.empty((2 * count - 1, 3)), np.empty((2 * count - 1, 3))
    place[:count], speed[:count] = joints, speeds
    for index in range(count - 1):
        share = _share(joints, index, point)
        for k in range(3):
            place[count + index, k] = (1.0 - share) * joints[index, k] + share * joints[
                index + 1, k
            ]
            speed[count + index, k] = (1.0 - share) * speeds[index, k] + share * speeds[
                index + 1, k
            ]
    return place, speed


@njit
def _share(joints: Any, index: int, point: Any) -> float:
    """Where along a limb, 0 to 1, it is next to a point."""
    squares, along = 0.0, 0.0
    for k in range(3):
        way = joints[index + 1, k] - joints[index, k]
        squares += way * way
        along += way * (point[k] - joints[index, k])
    return min(max(along / squares, 0.0), 1.0) if squares > 1e-12 else 0.0


@njit
def _nearest(joints: Any, point: Any) -> tuple[int, float]:
    """Limb next to a point, and where along it, 0 to 1."""
    best, limb, where = np.inf, 0, 0.0
    for index in range(len(joints) - 1):
        share = _share(joints, index, point)
        distance = 0.0
        for k in range(3):
            place = (1.0 - share) * joints[index, k] + share * joints[index + 1, k]
            distance += (place - point[k]) ** 2
        if distance < best:
            best, limb, where = distance, index, share
    return limb, where
