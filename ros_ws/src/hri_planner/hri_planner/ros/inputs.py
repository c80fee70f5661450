"""What the planner node knows of robot and people."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.situation import WRIST, PredictionError, uncertainty
from hri_planner.robot.model import RobotModel
from hri_planner.ros.conversions import check_side, forecast_from_message, reference_from_message
from hri_planner.supervision.freshness import Controller, Heard, HeardPerson, worst_of
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.ros.messages import ControllerState, HumanPrediction
from hri_prediction.ros.time import to_ns
from hri_prediction.tracked_lists import TrackedLists

FloatArray = NDArray[np.float64]
NOBODY = 1e9
"""Separation when nobody is seen [m]."""


@dataclass
class RobotInputs(ABC):
    """Newest messages of robot and controller; times on the ROS clock [ns].

    Attributes:
        radii: Of a person's upper arm, forearm and hand (3,) [m].
        lists: Who is tracked, as all sources say.
        reference: What the controller said last.
        reference_fault: What is wrong with the controller's newest reference; empty when it is used.
        joints_ns: Stamp of the newest joint states [ns].
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
    """

    what: ClassVar[str]
    """What is heard of people."""

    radii: FloatArray
    lists: TrackedLists = field(default_factory=TrackedLists)
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

    @property
    def state(self) -> tuple[FloatArray, FloatArray]:
        """Joint angles and speeds that a motion from here begins with (7,), (7,).

        What the controller asks for, not what the joints make of it: no step at hand-over.
        """
        if self.reference is None:
            return self.q, self.qd
        return (
            np.array(self.reference.reference_position),
            np.array(self.reference.reference_velocity),
        )

    @property
    def tracked(self) -> tuple[str, ...] | None:
        """Who is tracked; none while nobody has said so."""
        return self.lists.ids

    def heard(self, now_ns: int) -> Heard:
        """What was heard, and from when; ``now_ns`` is the time [ns]."""
        unlisted = self.lists.trouble(now_ns)
        reference, controller = self.reference, None
        if reference is not None:
            controller = Controller(
                to_ns(reference.header.stamp),
                active=reference.state != ControllerState.IDLE,
                stopping=reference.state == ControllerState.STOPPING,
                rate=float(reference.speed_scale),
                reason=reference.reason,
            )
        return Heard(
            self.joints_ns,
            controller,
            self.reference_fault,
            self.tracked,
            self.people_heard(),
            self.what,
            unlisted,
        )

    @abstractmethod
    def people_heard(self) -> dict[str, HeardPerson]:
        """From when what is known of each person is, and whether it may be used, by body id."""

    @abstractmethod
    def arms_now(self) -> list[FloatArray]:
        """Keypoints (4, 3) [m] of each tracked arm, as far as known."""

    @abstractmethod
    def newest_sample_ns(self) -> int:
        """Oldest among the newest samples of the tracked arms [ns]; 0 when nobody is tracked."""

    @abstractmethod
    def forget_body(self, body_id: str) -> None:
        """Drop what is known of a body."""

    def forget(self) -> None:
        """Drop what the robot said, because its stamps mean nothing any more."""
        self.reference, self.reference_fault = None, ""
        self.joints_ns = None

    def separation(self, robot: RobotModel) -> float:
        """Smallest surface distance robot-person now [m]."""
        smallest = math.inf
        capsules = robot.robot_capsules(self.q)
        for keypoints in self.arms_now():
            limbs = np.stack((keypoints[:-1], keypoints[1:]), axis=1)
            distances = capsule_distances(capsules, robot.capsule_radii, limbs, self.radii)
            smallest = min(smallest, float(distances.min()))
        return smallest if math.isfinite(smallest) else NOBODY


@dataclass
class _PredictedArm:
    """What is predicted of one arm.

    Attributes:
        message: The newest prediction; it may be INVALID.
        uncertainty: Of that prediction [m].
        error: Of the predictions so far.
    """

    message: HumanPrediction
    uncertainty: float = 0.0
    error: PredictionError = field(default_factory=PredictionError)

    @property
    def valid(self) -> bool:
        """Whether it may be used."""
        return bool(self.message.state != HumanPrediction.INVALID)

    def heard(self, name: str) -> HeardPerson:
        """From when it is, and whether it may be used; why not, with the arm's name before it."""
        return HeardPerson(
            to_ns(self.message.header.stamp),
            invalid=not self.valid,
            reason=name + self.message.reason,
        )


@dataclass
class Inputs(RobotInputs):
    """Newest inputs of a planner that hears predictions of people, of one arm or of both."""

    what = "prediction"

    _arms: dict[str, dict[str, _PredictedArm]] = field(default_factory=dict)

    def people_heard(self) -> dict[str, HeardPerson]:
        """From when each prediction is, and whether it may be used; of both arms the worse."""
        return {
            body_id: worst_of(
                arm.heard(f"{side} arm: " if len(arms) > 1 else "") for side, arm in arms.items()
            )
            for body_id, arms in self._arms.items()
        }

    def forget(self) -> None:
        """Drop what the robot and the predictor said, because its stamps mean nothing any more."""
        super().forget()
        self._arms.clear()

    def take_prediction(self, message: HumanPrediction) -> None:
        """Take what is predicted of one of a body's arms.

        Checked here, so that a bad message is named and never reaches the optimiser.

        Raises:
            DataError: when it cannot be used; the one before stays, and grows old.
        """
        check_side(message)
        arm = _PredictedArm(message)
        if arm.valid:
            forecast = forecast_from_message(message, 0, self.radii)
            arm.uncertainty = uncertainty(forecast)
            before = self._arms.get(message.body_id, {}).get(message.side)
            if before is not None:
                arm.error = before.error
            wrist = np.asarray(forecast.mean, dtype=float)[:, WRIST]
            arm.error.observe(forecast.time0_s, np.asarray(message.times, dtype=float), wrist)
        self._arms.setdefault(message.body_id, {})[message.side] = arm

    def forget_body(self, body_id: str) -> None:
        """Drop what is known of a body."""
        self._arms.pop(body_id, None)

    @property
    def uncertainties(self) -> list[float]:
        """Of the prediction of each arm that is in use [m]."""
        return [arm.uncertainty for arm in self._valid(self._arms)]

    @property
    def errors(self) -> list[float]:
        """Of the predictions of each arm that is in use [m]."""
        return [arm.error.rms for arm in self._valid(self._arms)]

    def _valid(self, bodies: Iterable[str]) -> list[_PredictedArm]:
        """Arms of these bodies whose predictions may be used."""
        arms = (arm for body_id in bodies for arm in self._arms.get(body_id, {}).values())
        return [arm for arm in arms if arm.valid]

    def _used(self) -> list[HumanPrediction]:
        return [arm.message for arm in self._valid(self.tracked or ())]

    def forecasts(self, origin_ns: int) -> list[HumanForecast]:
        """Forecasts of all tracked arms on a plan clock that is zero at ``origin_ns``."""
        return [forecast_from_message(p, origin_ns, self.radii) for p in self._used()]

    def newest_sample_ns(self) -> int:
        """Oldest among the newest samples of the tracked arms [ns]; 0 when nobody is tracked."""
        return min((to_ns(p.header.stamp) for p in self._used()), default=0)

    def arms_now(self) -> list[FloatArray]:
        """Keypoints of each tracked arm as they are predicted for now."""
        return [np.asarray(p.mean[:12], dtype=float).reshape(4, 3) for p in self._used()]
