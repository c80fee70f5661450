"""The arm of a person as optimal control has it, and as the world sees it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hri_prediction.arm.geometry import check_side
from hri_prediction.errors import DataError
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.convention import YAW_PITCH_ELBOW_PITCH
from hri_prediction.motor_control.design import TARGETS_DEG
from hri_prediction.motor_control.inverse import nearest_angles
from hri_prediction.motor_control.kinematics import elbow_and_wrist, hand, hand_jacobian
from hri_prediction.motor_control.seen import to_model, to_recording

Array = NDArray[np.float64]

CONVENTION = YAW_PITCH_ELBOW_PITCH.name
"""Of which the model comes nearest to elbow and wrist of people who sit at a table."""
REACHABLE_M = 0.2
"""A target further than this from where the arm gets is out of reach: so far a trunk goes along."""
_QUARTER = 0.5 * math.pi
_MARGIN = math.radians(0.5)
"""Postures keep so far off the limits of joints."""


@dataclass(frozen=True, eq=False)
class BodyArm:
    """One arm of a person.

    All vectors are relative to the shoulder, along the axes of the world [m].

    Attributes:
        arm: Lengths, masses, and how joints turn.
        hand_m: From the wrist to the tip of the hand, along the forearm.
        facing_rad: Where the person faces in the world, from x towards y.
        side: "left" or "right".
        limits: Of the joints.
    """

    arm: ArmModel
    hand_m: float
    facing_rad: float
    side: str
    limits: JointLimits = ANATOMICAL

    def __post_init__(self) -> None:
        check_side(self.side)
        if not (math.isfinite(self.hand_m) and self.hand_m >= 0.0):
            raise DataError(f"a hand of {self.hand_m} m", expected="0 or more")
        if not math.isfinite(self.facing_rad):
            raise DataError(f"facing {self.facing_rad} rad", expected="a finite angle")

    @staticmethod
    def measured(points: Array, side: str, facing_rad: float, hand_m: float) -> BodyArm:
        """The arm of a person who was seen: lengths are medians, masses those of an average body.

        Args:
            points: Shoulder, elbow, wrist, tip (N, 4, 3) [m]; NaN where not seen.
            side: Which arm.
            facing_rad: Where the person faces.
            hand_m: From wrist to tip, where the tip is never seen.

        Raises:
            DataError: when shoulder, elbow and wrist are never seen together.
        """
        seen = points[np.isfinite(points[:, :3]).all(axis=(1, 2))]
        if not len(seen):
            raise DataError(
                "shoulder, elbow and wrist are never seen together", expected="a usable arm"
            )
        lengths = np.linalg.norm(np.diff(seen, axis=1), axis=2)
        upper, forearm = np.median(lengths[:, :2], axis=0)
        tips = lengths[np.isfinite(lengths[:, 2]), 2]
        arm = ArmModel.of_body(
            upper_m=_to_mm(upper), forearm_m=_to_mm(forearm), convention=CONVENTION
        )
        return BodyArm(arm, _to_mm(np.median(tips)) if len(tips) else hand_m, facing_rad, side)

    def positions(self, angles: Array) -> Array:
        """Elbow and wrist (N, 6) at joint angles (N, 3) [rad]."""
        elbow, wrist = elbow_and_wrist(angles, self.arm)
        return np.concatenate([self._to_world(elbow), self._to_world(wrist)], axis=-1)

    def posture(self, elbow_wrist: Array) -> Array:
        """Joint angles (3,) [rad] of the model that come nearest to elbow and wrist (6,).

        Raises:
            DataError: when a segment has no length.
        """
        return self.postures(elbow_wrist[None])[0]

    def postures(self, elbow_wrist: Array) -> Array:
        """Joint angles (N, 3) [rad] nearest to elbows and wrists (N, 6), a little off the limits."""
        points = np.zeros((len(elbow_wrist), 3, 3))
        points[:, 1:] = self._to_model(elbow_wrist.reshape(-1, 2, 3))
        return self._within(nearest_angles(points, self.arm, self.limits))

    def posture_at(self, tip: Array, start: Array) -> Array:
        """Joint angles (3,) [rad] with the tip of the hand at a point (3,), or as near as it comes.

        Where several are possible, that nearest to those that the thesis' people had at its targets.

        Args:
            tip: Where the hand ends.
            start: Joint angles at the begin of the reach (3,).

        Raises:
            DataError: the hand does not get near.
        """
        goal = self._to_model(np.asarray(tip, dtype=float))
        long = replace(self.arm, forearm_m=self.arm.forearm_m + self.hand_m)
        usual = np.radians(TARGETS_DEG.mean(axis=0))
        low, high = np.array(self.limits.lower) + _MARGIN, np.array(self.limits.upper) - _MARGIN
        straight_ahead = math.atan2(goal[1], goal[0])
        found = []
        for first in (usual, start, np.array([usual[0], straight_ahead, usual[2]])):
            solved = least_squares(
                lambda q: hand(q, long) - goal,
                np.clip(first, low + 1e-6, high - 1e-6),
                jac=lambda q: hand_jacobian(q, long),
                bounds=(low, high),
                xtol=1e-10,
            )
            miss = float(np.linalg.norm(hand(solved.x, long) - goal))
            found.append((miss, float(np.linalg.norm(solved.x - usual)), solved.x))
        least = min(miss for miss, _, _ in found)
        if least > REACHABLE_M:
            raise DataError(
                f"the hand comes no nearer than {100.0 * least:.0f} cm to the target at "
                f"{np.round(tip, 2).tolist()} from the shoulder",
                expected=f"a target within {100.0 * REACHABLE_M:.0f} cm of where it gets",
                hint="are targets, tracking and facing in the same axes?",
            )
        alike = [each for each in found if each[0] <= least + 1e-3]
        angles: Array = min(alike, key=lambda each: each[1])[2]
        return angles

    def tips(self, elbow_wrist: Array) -> Array:
        """Tips of the hand (N, 3) at elbows and wrists (N, 6): along the forearm."""
        forearm = elbow_wrist[:, 3:] - elbow_wrist[:, :3]
        length = np.linalg.norm(forearm, axis=1, keepdims=True)
        found: Array = elbow_wrist[:, 3:] + forearm * (self.hand_m / np.maximum(length, 1e-9))
        return found

    def _within(self, angles: Array) -> Array:
        low, high = np.array(self.limits.lower) + _MARGIN, np.array(self.limits.upper) - _MARGIN
        found: Array = np.clip(angles, low, high)
        return found

    def _to_world(self, vectors: Array) -> Array:
        return to_recording(vectors, self.facing_rad, self.side)

    def _to_model(self, vectors: Array) -> Array:
        return to_model(vectors, self.facing_rad, self.side)


def _to_mm(length: float) -> float:
    """Whole millimetres: nobody knows more, and solvers of the same arm are made once."""
    return round(float(length), 3)


def facing_towards(shoulder: Array, targets: Array) -> float:
    """Where a person faces who has targets in front, to the nearest quarter turn [rad].

    Args:
        shoulder: (3,) [m].
        targets: (N, 3) [m].
    """
    way = np.asarray(targets, dtype=float).mean(axis=0) - shoulder
    return _QUARTER * round(math.atan2(way[1], way[0]) / _QUARTER)
