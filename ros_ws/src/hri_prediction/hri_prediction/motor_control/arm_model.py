"""The arm as two rigid links with three joints: lengths, masses, inertias and limits (thesis 2.2.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import ConfigError
from hri_prediction.motor_control.convention import YAW_PITCH, convention_of

Array = NDArray[np.float64]

UPPER_LENGTH, FOREARM_LENGTH = 0.186, 0.146
"""Segment lengths by body height (Drillis and Contini 1966, in Winter, Biomechanics and Motor Control of
Human Movement, 4th ed. 2009, figure 4.1): shoulder to elbow, elbow to wrist."""
UPPER_MASS, FOREARM_MASS = 0.028, 0.022
"""Segment masses by body mass (Winter 2009, table 4.1): upper arm; forearm and hand."""
UPPER_CENTRE, FOREARM_CENTRE = 0.436, 0.682
"""Centres of mass from the proximal joint by segment length (the same): upper arm; forearm and hand."""
UPPER_GYRATION, FOREARM_GYRATION = 0.322, 0.468
"""Radii of gyration about the centre of mass, across the segment, by its length (the same)."""
BODY_HEIGHT_M, BODY_MASS_KG = 1.72, 70.0
"""Of somebody of whom nothing is known; the thesis' people were 172 +- 5 cm and 67 +- 9 kg."""
GRAVITY = 9.81
LIMITS_DEG = ((-90.0, 90.0), (-45.0, 135.0), (0.0, 150.0))
"""Least and greatest joint angles. Shoulder: raised to the vertical and hanging down (flexion and
abduction go on to 180 degrees, but by rolling the arm, which this model does not do); horizontal
abduction 45 and adduction 135;
elbow: flexion 150 (American Academy of Orthopaedic Surgeons, in Norkin and White, Measurement of Joint
Motion, 5th ed. 2016)."""


@dataclass(frozen=True)
class ArmModel:
    """A right or left arm without friction, shoulder roll and wrist.

    Attributes:
        upper_m: Shoulder to elbow [m].
        forearm_m: Elbow to wrist [m].
        upper_kg: Mass of the upper arm.
        forearm_kg: Mass of forearm and hand.
        upper_centre_m: From the shoulder to the centre of mass of the upper arm.
        forearm_centre_m: From the elbow to that of forearm and hand.
        upper_across: Moment of inertia of the upper arm about its centre of mass, across it [kg m^2].
        forearm_across: The same of forearm and hand.
        upper_along: Moment of inertia about its own axis; 0: a thin rod.
        forearm_along: The same of forearm and hand.
        gravity: [m/s^2].
        convention: Name of how the joints turn (`hri_prediction.motor_control.convention`).

    Raises:
        ConfigError: when a value is not finite, or no length, mass or inertia can be like that.
    """

    upper_m: float
    forearm_m: float
    upper_kg: float
    forearm_kg: float
    upper_centre_m: float
    forearm_centre_m: float
    upper_across: float
    forearm_across: float
    upper_along: float = 0.0
    forearm_along: float = 0.0
    gravity: float = GRAVITY
    convention: str = YAW_PITCH.name

    def __post_init__(self) -> None:
        convention_of(self.convention)
        least_allowed = {"upper_along": 0.0, "forearm_along": 0.0, "gravity": 0.0}
        for name in PARAMETERS:
            value = getattr(self, name)
            if (
                not math.isfinite(value)
                or value < 0.0
                or (value == 0.0 and name not in least_allowed)
            ):
                raise ConfigError(
                    f"ArmModel.{name} = {value!r}",
                    expected="a finite number, "
                    + ("0 or more" if name in least_allowed else "more than 0"),
                )

    @staticmethod
    def of_body(
        height_m: float = BODY_HEIGHT_M,
        mass_kg: float = BODY_MASS_KG,
        *,
        upper_m: float | None = None,
        forearm_m: float | None = None,
        convention: str = YAW_PITCH.name,
    ) -> ArmModel:
        """The arm of somebody of this height and mass; measured lengths go before those by height.

        Raises:
            ConfigError: height, mass or a length is not finite and positive.
        """
        for name, value in (("height", height_m), ("mass", mass_kg)):
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError(f"body {name} {value!r}", expected="a positive number")
        upper = UPPER_LENGTH * height_m if upper_m is None else upper_m
        forearm = FOREARM_LENGTH * height_m if forearm_m is None else forearm_m
        upper_kg, forearm_kg = UPPER_MASS * mass_kg, FOREARM_MASS * mass_kg
        return ArmModel(
            upper_m=upper,
            forearm_m=forearm,
            upper_kg=upper_kg,
            forearm_kg=forearm_kg,
            upper_centre_m=UPPER_CENTRE * upper,
            forearm_centre_m=FOREARM_CENTRE * forearm,
            upper_across=upper_kg * (UPPER_GYRATION * upper) ** 2,
            forearm_across=forearm_kg * (FOREARM_GYRATION * forearm) ** 2,
            convention=convention,
        )

    @property
    def parameters(self) -> Array:
        """Lengths, masses, inertias and gravity (11,), in the order of `PARAMETERS`."""
        return np.array([getattr(self, name) for name in PARAMETERS])


PARAMETERS = tuple(field.name for field in fields(ArmModel) if field.name != "convention")
"""Names of the numbers of a model, in the order in which generated code takes them."""


@dataclass(frozen=True)
class JointLimits:
    """Least and greatest joint angles.

    Attributes:
        lower: (3,) [rad].
        upper: (3,) [rad].

    Raises:
        ConfigError: when they are not finite, or leave no room.
    """

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    def __post_init__(self) -> None:
        low, high = np.array(self.lower), np.array(self.upper)
        if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
            raise ConfigError(
                f"joint limits {self.lower} to {self.upper}", expected="finite, lower below upper"
            )

    @staticmethod
    def degrees(limits: tuple[tuple[float, float], ...] = LIMITS_DEG) -> JointLimits:
        """Limits given as (least, greatest) of each joint [deg]."""
        low, high = np.radians(np.array(limits)).T
        return JointLimits(tuple(low.tolist()), tuple(high.tolist()))


ANATOMICAL = JointLimits.degrees()
