"""People who reach as the optimum of a mix of costs that is their own, seen by motion capture."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import (
    ANATOMICAL,
    UPPER_LENGTH,
    UPPER_MASS,
    ArmModel,
)
from hri_prediction.motor_control.convention import YAW_PITCH
from hri_prediction.motor_control.costs import CHAPTER_2, indices_of
from hri_prediction.motor_control.kinematics import elbow_and_wrist
from hri_prediction.motor_control.law import WeightLaw
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import rescaled, scaling_of
from hri_prediction.motor_control.seen import arm_of, at_rest, mean_of, observe, to_recording
from hri_prediction.motor_control.whole import WholeReach, observe_whole
from hri_prediction.tracks.segmentation import SegmentationConfig, find_reaches
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

FACING_RAD = 0.5 * np.pi
"""Where they face in the axes of their recordings."""
RATE_HZ = 250.0
REST_S = 0.3
NOISE_M = 0.003
"""Standard deviation of each coordinate of each keypoint."""
REPETITIONS = 3
HAND_M = 0.08
_HEIGHT_M, _MASS_KG = (1.72, 0.05), (67.0, 9.0)
"""Mean and standard deviation; those of the thesis' people."""
_PACE_SD, _TRIAL_PACE_SD = 0.19, 0.04
_POSTURE_SD_RAD, _TRIAL_POSTURE_SD_RAD = np.radians(5.0), np.radians(1.5)
"""Between people (table 2.2), and between repetitions."""
_ATTEMPTS = 5
"""So often may a repetition be drawn for which no optimum is found."""
_USUAL = {"hand_jerk": 0.31, "joint_jerk": 0.45, "torque_change": 0.09, "energy": 0.15}
"""Mean weights of the thesis' people."""
_DYNAMIC, _HAND_JERK = 5.0, -3.0
"""Logarithm of a ratio to joint jerk by the thesis' discomfort (eq. 3.5): of torque change and energy, and
of hand jerk. Ours, as is how people differ: discomfort explains 0.62 of the share of the dynamic costs (of
theirs, smoothed, 0.52), weights scatter by 0.16, 0.12, 0.07 and 0.14 (theirs 0.18, 0.14, 0.12, 0.16)."""
_BETA = (0.8150, -0.4477)
"""Of that discomfort (eq. 3.8)."""
_OWN_SD = 0.7
"""How laws differ between people, logarithm of a ratio and by radian."""


@dataclass(frozen=True, eq=False)
class Reacher:
    """A simulated person.

    Attributes:
        name: Of the subject.
        arm: True lengths and masses.
        law: True weights by posture.
        pace: Factor on durations.
        offsets: What the person makes of each start posture and target (starts + targets, 3) [rad].
    """

    name: str
    arm: ArmModel
    law: WeightLaw
    pace: float
    offsets: Array


@dataclass(frozen=True, eq=False)
class Recorded:
    """Repetitions of one reach of one person.

    Attributes:
        start: Index of the start posture.
        target: Index of the target.
        alpha: True weights (n,).
        factors: Scale factors S of these costs with which they are true, mean of the repetitions (n,).
        tracks: What motion capture saw of each repetition.
        ends: When each began and ended, (repetitions, 2) [s].
    """

    start: int
    target: int
    alpha: Array
    factors: Array
    tracks: tuple[ArmTrack, ...]
    ends: Array

    def alpha_with(self, factors: Array) -> Array:
        """The same weights with other scale factors (n,)."""
        return rescaled(self.alpha, self.factors, factors)


def common_slopes() -> Array:
    """How everybody's logarithms of ratios to joint jerk depend on both postures (3, 6) [1/rad]."""
    # Discomfort by q1, q2, q3 at the start, then at the end; angles count by half a turn.
    of_discomfort = np.array([-1.0 - _BETA[1], _BETA[0], 0.0, _BETA[1], 0.0, 0.0]) / np.pi
    of_start = np.where(np.arange(6) < 3, of_discomfort, 0.0)
    by_cost = {
        "hand_jerk": _HAND_JERK * of_start,
        "torque_change": _DYNAMIC * of_discomfort,
        "energy": _DYNAMIC * of_discomfort,
    }
    return np.array([by_cost[name] for name in CHAPTER_2 if name != "joint_jerk"])


def draw_people(
    count: int,
    rng: np.random.Generator,
    starts_deg: Array = design.STARTS_DEG,
    convention: str = YAW_PITCH.name,
) -> list[Reacher]:
    """People who have a law of weights in common, and each their own variation of it.

    The more discomfort a reach is, the larger is the part of the dynamic costs, as the thesis found
    (figures 2.9 and 3.7); hand jerk depends on the start posture alone (table 3.3).

    Args:
        count: How many.
        rng: Draws them.
        starts_deg: Postures that they will begin in (N, 3).
        convention: Of the joint angles of their arms.
    """
    usual = np.array([_USUAL[name] for name in CHAPTER_2])
    logs = np.delete(np.log(usual / _USUAL["joint_jerk"]), CHAPTER_2.index("joint_jerk"))
    slopes = common_slopes()
    middle = np.radians(np.concatenate([starts_deg.mean(axis=0), design.TARGETS_DEG.mean(axis=0)]))
    people = []
    for number in range(count):
        own = slopes + rng.normal(0.0, _OWN_SD, slopes.shape)
        base = logs + rng.normal(0.0, _OWN_SD, logs.shape)
        theta = np.column_stack([base - own @ middle, own])
        height, mass = (max(rng.normal(*each), 0.7 * each[0]) for each in (_HEIGHT_M, _MASS_KG))
        people.append(
            Reacher(
                name=f"S{number + 1}",
                arm=ArmModel.of_body(float(height), float(mass), convention=convention),
                law=WeightLaw(CHAPTER_2, theta),
                pace=float(np.exp(rng.normal(0.0, _PACE_SD))),
                offsets=rng.normal(
                    0.0, _POSTURE_SD_RAD, (len(starts_deg) + len(design.TARGETS_DEG), 3)
                ),
            )
        )
    return people


def record(
    person: Reacher,
    start: int,
    target: int,
    rng: np.random.Generator,
    *,
    starts_deg: Array = design.STARTS_DEG,
    repetitions: int = REPETITIONS,
    noise_m: float = NOISE_M,
) -> Recorded:
    """Let a person reach from a start posture to a target, some times.

    The weights are those of the person's usual postures at both ends, in all repetitions.
    """
    usual = [
        _within(np.radians(starts_deg[start]) + person.offsets[start]),
        _within(np.radians(design.TARGETS_DEG[target]) + person.offsets[len(starts_deg) + target]),
    ]
    alpha = person.law.alpha(*usual)
    solver = ReachSolver(person.arm)
    chosen = indices_of(person.law.names)
    tracks, ends, factors = [], [], []
    for trial in range(repetitions):
        motion, factor = _reach(person, usual, float(design.DURATIONS_S[target]), solver, rng)
        duration_s = motion.duration
        factors.append(factor[chosen])
        time_s = np.arange(round((duration_s + 2.0 * REST_S) * RATE_HZ)) / RATE_HZ
        angles = motion.angles(np.clip((time_s - REST_S) / duration_s, 0.0, 1.0))
        points = _keypoints(angles, person.arm)
        points += rng.normal(0.0, noise_m, points.shape) if noise_m > 0.0 else 0.0
        tracks.append(
            ArmTrack(
                time_s, points, subject=person.name, task=f"P{start + 1}-T{target + 1}", trial=trial
            )
        )
        ends.append((REST_S, REST_S + duration_s))
    return Recorded(start, target, alpha, np.mean(factors, axis=0), tuple(tracks), np.array(ends))


def _reach(
    person: Reacher,
    usual: list[Array],
    duration: float,
    solver: ReachSolver,
    rng: np.random.Generator,
) -> tuple[Motion, Array]:
    """One repetition: its motion, and all scale factors (7,).

    Where no optimum is found for what was drawn, it is drawn anew.

    Raises:
        NotConverged: none is found for anything that was drawn.
    """
    for attempt in range(_ATTEMPTS):
        q_start, q_end = (_within(q + rng.normal(0.0, _TRIAL_POSTURE_SD_RAD, 3)) for q in usual)
        pace = person.pace * np.exp(rng.normal(0.0, _TRIAL_PACE_SD))
        problem = ReachProblem.at_rest(q_start, q_end, float(duration * pace))
        alpha = person.law.alpha(*usual)
        try:
            scaling = scaling_of(solver, problem)
            weights = scaling.weights(alpha, person.law.names)
            return solver.solve(problem, weights), scaling.factors
        except NotConverged:
            if attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("there is one attempt at least")


def see(recorded: Recorded, arm: ArmModel) -> ObservedReach:
    """The mean of the repetitions, as `scripts/fit_ioc.py --average` has it.

    Args:
        recorded: What was recorded.
        arm: What is known of the person's arm.
    """
    reaches = see_each(recorded, arm, whole=False)
    return mean_of(reaches, arm, f"{recorded.tracks[0].subject} {recorded.tracks[0].task}")


def see_each(recorded: Recorded, arm: ArmModel, *, whole: bool) -> list[ObservedReach]:
    """Each repetition, as `scripts/fit_ioc.py` has them.

    Args:
        recorded: What was recorded.
        arm: What is known of the person's arm.
        whole: Whether it is known when each began and ended, so that it is whole, from rest to rest.
    """
    reaches = [
        observe(
            track,
            float(begin),
            float(end),
            arm,
            facing_rad=FACING_RAD,
            trim=not whole,
            name=track.task,
        )
        for track, (begin, end) in zip(recorded.tracks, recorded.ends, strict=True)
    ]
    return [at_rest(each) for each in reaches] if whole else reaches


def see_whole(recorded: Recorded, arm: ArmModel) -> list[WholeReach]:
    """The repetitions from rest to rest that `scripts/fit_ioc.py --law --whole` finds.

    When each began and ended is not known, but what the segmentation cuts; what it does not find, or what
    no rest is seen of, is left out.

    Args:
        recorded: What was recorded.
        arm: What is known of the person's arm.
    """
    found = []
    for track in recorded.tracks:
        cut = find_reaches(track.time_s, track.keypoints[:, 2], SegmentationConfig())
        if not cut:
            continue
        longest = max(cut, key=lambda reach: reach.duration_s)
        ends = (longest.onset_s, longest.end_s)
        with contextlib.suppress(DataError):
            found.append(observe_whole(track, *ends, arm, facing_rad=FACING_RAD, name=track.task))
    return found


def measured_arm(person: Reacher, recordings: list[Recorded]) -> ArmModel:
    """The arm as it is known from recordings, and the person's height and mass from asking."""
    if not recordings:
        raise DataError("no recordings to measure an arm in", expected="one or more")
    height = person.arm.upper_m / UPPER_LENGTH
    mass = person.arm.upper_kg / UPPER_MASS
    tracks = [track for each in recordings for track in each.tracks]
    return arm_of(tracks, height_m=height, mass_kg=mass, convention=person.arm.convention)


def _within(angles: Array) -> Array:
    """Angles, kept a little off the limits of the joints."""
    margin = np.radians(0.5)
    low, high = np.array(ANATOMICAL.lower) + margin, np.array(ANATOMICAL.upper) - margin
    found: Array = np.clip(angles, low, high)
    return found


def _keypoints(angles: Array, arm: ArmModel) -> Array:
    """Shoulder, elbow, wrist and hand tip (N, 4, 3), the shoulder a metre above the ground."""
    elbow, wrist = elbow_and_wrist(angles, arm)
    points = np.zeros((len(angles), 4, 3))
    points[:, 1], points[:, 2] = elbow, wrist
    points[:, 3] = wrist + HAND_M / arm.forearm_m * (wrist - elbow)
    return to_recording(points, FACING_RAD, "right") + np.array([0.0, 0.0, 1.0])
