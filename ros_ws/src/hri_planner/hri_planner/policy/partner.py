"""What is known of a partner: the hand, which policies see, and the arm behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.limbs import nearest_on, places_of
from hri_planner.policy.separation import Places
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
        index, share = nearest_on(self.joints, point)
        return (
            (1.0 - share) * self.joints[index] + share * self.joints[index + 1],
            (1.0 - share) * self.speeds[index] + share * self.speeds[index + 1],
        )

    def distance(self, point: FloatArray) -> float:
        """Of a point (3,) from the limbs' axes [m]."""
        return float(np.linalg.norm(self.nearest(point)[0] - point))
