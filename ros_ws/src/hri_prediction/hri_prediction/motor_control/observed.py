"""A reach that was seen, brought to the model of the arm: what inverse optimal control explains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.geometry.warping import warped_distance
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.kinematics import hand
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]

_LEAST = 10


@dataclass(frozen=True, eq=False)
class ObservedReach:
    """One reach, or the mean of some.

    Attributes:
        problem: Its ends and duration.
        phases: Of the samples (N,), from 0 to 1, increasing.
        angles: Joint angles (N, 3) [rad].
        hand: Path of the hand of the *model* at these angles, from the shoulder (N, 3) [m]: shoulder
            and trunk stand still in it, and segments keep their lengths (thesis 2.2.4.3, step 3).
        name: For reports.
        misfit_m: How far elbow and wrist of the model are from where they were seen (root mean square) [m]:
            what the shoulder rolls, above all. The path is not to be explained any nearer.

    Raises:
        DataError: on wrong shapes, too few samples, or what is not finite.
    """

    problem: ReachProblem
    phases: Array
    angles: Array
    hand: Array
    name: str = ""
    misfit_m: float = 0.0

    def __post_init__(self) -> None:
        count = len(self.phases)
        for name, shape in (("phases", (count,)), ("angles", (count, 3)), ("hand", (count, 3))):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or count < _LEAST:
                raise DataError(
                    f"{name} of a reach has shape {array.shape}",
                    expected=f"{_LEAST} or more samples; angles and hand (N, 3)",
                )
            if not np.isfinite(array).all():
                raise DataError(
                    f"{name} of the reach {self.name}: {int((~np.isfinite(array)).sum())} values are not "
                    "finite",
                    expected="gaps to be filled or cut out before",
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if (np.diff(self.phases) <= 0.0).any() or self.phases[0] < 0.0 or self.phases[-1] > 1.0:
            raise DataError("phases of a reach", expected="increasing, from 0 to 1")

    def distance(self, path: Array) -> float:
        """How far a path of the hand (M, 3) is from this one [m]: warped, by the samples seen."""
        return warped_distance(path, self.hand) / len(self.hand)

    def joint_distance(self, angles: Array) -> float:
        """The same of joint angles (M, 3) [rad]."""
        return warped_distance(angles, self.angles) / len(self.angles)


def of_angles(problem: ReachProblem, angles: Array, arm: ArmModel, name: str = "") -> ObservedReach:
    """A reach of joint angles (N, 3) at evenly spaced times from its begin to its end."""
    phases = np.linspace(0.0, 1.0, len(angles))
    return ObservedReach(problem, phases, angles, hand(angles, arm), name)
