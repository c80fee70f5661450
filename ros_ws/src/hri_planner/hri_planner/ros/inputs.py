"""What the planner node knows of robot and people, and whether that is enough to move."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.robot.model import RobotModel
from hri_planner.ros.conversions import forecast_from_message, reference_from_message
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.ros.messages import ControllerState, HumanPrediction
from hri_prediction.ros.time import NANO, to_ns

FloatArray = NDArray[np.float64]
NOBODY = 1e9
"""Separation when nobody is seen [m]."""


@dataclass
class Inputs:
    """Newest inputs; times on the ROS clock [ns].

    Attributes:
        max_joint_age_s: Older joint states count as missing [s].
        max_sample_age_s: A prediction whose newest sample is older counts as missing [s].
        require_tracking: Whether a graph without any tracking source may not move.
        radii: Of upper arm, forearm and hand (3,) [m].
        reference_fault: What is wrong with the controller's newest reference; empty when it is used.
    """

    max_joint_age_s: float
    max_sample_age_s: float
    require_tracking: bool
    radii: FloatArray
    tracked: tuple[str, ...] | None = None
    predictions: dict[str, HumanPrediction] = field(default_factory=dict)
    reference: ControllerState | None = None
    reference_fault: str = ""
    joints_ns: int | None = None
    q: FloatArray = field(default_factory=lambda: np.zeros(7))
    qd: FloatArray = field(default_factory=lambda: np.zeros(7))

    def take_reference(self, message: ControllerState, joint_names: tuple[str, ...]) -> None:
        """Take what the controller says; what cannot be used leaves the one before, which grows old.

        Raises:
            DataError: saying what is wrong with it.
        """
        try:
            self.reference = reference_from_message(message, joint_names)
        except DataError as error:
            self.reference_fault = str(error)
            raise
        self.reference_fault = ""

    def joints_problem(self, now_ns: int) -> str:
        """Why nobody knows where the robot is; empty when that is known."""
        if self.joints_ns is None:
            return "no /joint_states yet"
        age = (now_ns - self.joints_ns) / NANO
        if age > self.max_joint_age_s:
            return f"/joint_states are {age:.2f} s old"
        if age < -self.max_joint_age_s:
            return f"/joint_states are stamped {-age:.2f} s in the future"
        if self.reference is None:
            # Empty where no controller speaks: plans then begin where the joints are.
            return self.reference_fault
        # Plans begin where the controller is: extrapolated over a stall, that is a jump.
        age = (now_ns - to_ns(self.reference.header.stamp)) / NANO
        if abs(age) > self.max_joint_age_s:
            why = f": {self.reference_fault}" if self.reference_fault else ""
            return f"the controller's reference is {age:.2f} s old{why}"
        return ""

    def problem(self, now_ns: int) -> str:
        """Why the robot must not move now; empty when it may."""
        unseen = self.joints_problem(now_ns)
        if unseen:
            return unseen
        if self.tracked is None:
            return "nothing says who is tracked" if self.require_tracking else ""
        for body_id in self.tracked:
            prediction = self.predictions.get(body_id)
            if prediction is None:
                return f"no prediction of {body_id} yet"
            if prediction.state == HumanPrediction.INVALID:
                return f"the prediction of {body_id} is invalid: {prediction.reason}"
            age = (now_ns - to_ns(prediction.header.stamp)) / NANO
            if age > self.max_sample_age_s:
                return f"the newest sample behind the prediction of {body_id} is {age:.3f} s old"
            if age < -self.max_sample_age_s:
                return f"the prediction of {body_id} is stamped {-age:.3f} s in the future"
        return ""

    def forget(self) -> None:
        """Drop what the robot and the predictor said, because its stamps mean nothing any more."""
        self.predictions.clear()
        self.reference, self.reference_fault = None, ""
        self.joints_ns = None

    @staticmethod
    def check(message: HumanPrediction, radii: FloatArray) -> None:
        """Raise DataError when a prediction cannot be used."""
        forecast_from_message(message, 0, radii)

    def _used(self) -> list[HumanPrediction]:
        found = (self.predictions.get(body_id) for body_id in self.tracked or ())
        return [p for p in found if p is not None and p.state != HumanPrediction.INVALID]

    def forecasts(self, origin_ns: int) -> list[HumanForecast]:
        """Forecasts of all tracked arms on a plan clock that is zero at ``origin_ns``."""
        return [forecast_from_message(p, origin_ns, self.radii) for p in self._used()]

    def newest_sample_ns(self) -> int:
        """Oldest among the newest samples of the tracked arms [ns]; 0 when nobody is tracked."""
        return min((to_ns(p.header.stamp) for p in self._used()), default=0)

    def separation(self, robot: RobotModel) -> float:
        """Smallest surface distance robot-person now [m], from the arms as they are predicted now."""
        smallest = math.inf
        capsules = robot.robot_capsules(self.q)
        for prediction in self._used():
            keypoints = np.asarray(prediction.mean[:12], dtype=float).reshape(4, 3)
            limbs = np.stack((keypoints[:-1], keypoints[1:]), axis=1)
            distances = capsule_distances(capsules, robot.capsule_radii, limbs, self.radii)
            smallest = min(smallest, float(distances.min()))
        return smallest if math.isfinite(smallest) else NOBODY
