"""Where a recording is put in the robot's world.

Laboratories have their own axes. A :class:`Placement` turns a recording about the vertical and
moves it, so that its person sits across the table from the robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError, DataError


@dataclass(frozen=True)
class Placement:
    """Rotation about z, then a translation: lab frame to world frame.

    Attributes:
        x: Translation along the world's x [m] (towards the person, from the robot).
        y: Translation along the world's y [m].
        z: Translation along the world's z [m] (up).
        yaw: Rotation about the lab's vertical axis [rad], applied before the translation.

    Raises:
        ConfigError: when a number is not finite.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("x", "y", "z", "yaw"):
            value = getattr(self, name)
            if not math.isfinite(value):
                raise ConfigError(f"Placement.{name} = {value!r}", expected="a finite number")

    @classmethod
    def parse(cls, text: str) -> Placement:
        """Read ``"X,Y,Z,YAW"``: metres, and the yaw in degrees.

        Raises:
            ConfigError: when the text is not four finite numbers.
        """
        expected = "X,Y,Z,YAW: three lengths in m and an angle in degrees, as in 0.9,0,0.1,90"
        try:
            x, y, z, yaw = (float(part) for part in text.split(","))
        except ValueError as error:
            raise ConfigError(f"placement {text!r}", expected=expected) from error
        try:
            return cls(x, y, z, math.radians(yaw))
        except ConfigError as error:
            raise ConfigError(f"placement {text!r}", expected=expected) from error

    def __str__(self) -> str:
        """The text that :meth:`parse` reads, rounded to 0.1 mm and 0.01 degree."""
        values = (round(self.x, 4), round(self.y, 4), round(self.z, 4))
        yaw = round(math.degrees(self.yaw), 2)
        # Adding 0.0 turns -0.0 into 0.0.
        return ",".join(f"{value + 0.0:g}" for value in (*values, yaw))

    @property
    def rotation(self) -> FloatArray:
        """Rotation matrix lab to world, shape (3, 3)."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def apply(self, points: ArrayLike) -> FloatArray:
        """Lab coordinates to world coordinates.

        Args:
            points: Shape (..., 3) [m]; NaN stays NaN.

        Returns:
            Shape (..., 3) [m], a new array.

        Raises:
            DataError: when the last axis is not 3 long.
        """
        lab = np.asarray(points, dtype=np.float64)
        if lab.ndim < 1 or lab.shape[-1] != 3:
            raise DataError(f"points have shape {lab.shape}", expected="(..., 3)")
        return lab @ self.rotation.T + np.array([self.x, self.y, self.z])

    @property
    def inverse(self) -> Placement:
        """The placement that undoes this one."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        x = -(cosine * self.x + sine * self.y)
        y = -(-sine * self.x + cosine * self.y)
        return Placement(x, y, -self.z, -self.yaw)
