"""From recorded keypoints to a reach in the model of the arm (thesis 2.2.4.3, steps 1 to 3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_lsq_spline

from hri_prediction.errors import DataError
from hri_prediction.motor_control.arm_model import (
    ANATOMICAL,
    BODY_HEIGHT_M,
    BODY_MASS_KG,
    ArmModel,
    JointLimits,
)
from hri_prediction.motor_control.convention import YAW_PITCH
from hri_prediction.motor_control.inverse import nearest_angles
from hri_prediction.motor_control.kinematics import elbow_and_wrist, hand
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

SHARE_OF_PEAK = 0.05
"""A reach goes from this share of its peak hand speed to the same (thesis 2.2.8)."""
CUT_SHARE = math.sqrt(1.0 - math.sqrt(SHARE_OF_PEAK))
"""So much of the duration of a movement of least jerk is left by that: its speed is 16 x²(1 - x)² of the
peak at phase x."""
KNOT_S = 0.12
"""Distance of the knots of the splines that smooth joint angles [s]: what is faster than about 4 Hz is
noise."""
MARGIN_S = 0.15
"""So much before and after a reach helps to know velocities at its ends."""
MAX_GAP_S = 0.1
"""The longest gap in a recording that is bridged."""
_IN_FLIGHT = 0.5
"""A hand that is faster than that share of its peak where a reach begins may be in the middle of one."""
_SEEN_S = 0.1
"""It is, where nothing was seen for so long before; speeds are known half as long after what is first."""
_AFTER_GAP = 0.1
"""Likewise where more was seen before a gap: that the hand had set out then is certain."""
_LOOK_S = 1.0
"""So far beyond a reach a gap is looked for [s]."""
_ALIKE_M = 0.2
"""Repetitions begin and end within this distance from the mean of all."""
_DEGREE = 5


def to_model(points: Array, facing_rad: float, side: str) -> Array:
    """Turn vectors (..., 3) from the axes of a recording into those of the arm model.

    Args:
        points: z up.
        facing_rad: Where the person faces, from x towards y.
        side: "left" or "right"; the model of a left arm is mirrored.
    """
    turn = 0.5 * math.pi - facing_rad
    c, s = math.cos(turn), math.sin(turn)
    x, y = points[..., 0], points[..., 1]
    across = c * x - s * y
    return np.stack(
        [across if side == "right" else -across, s * x + c * y, points[..., 2]], axis=-1
    )


def to_recording(points: Array, facing_rad: float, side: str) -> Array:
    """Turn vectors (..., 3) of the arm model back into the axes of a recording."""
    turn = facing_rad - 0.5 * math.pi
    c, s = math.cos(turn), math.sin(turn)
    x = points[..., 0] if side == "right" else -points[..., 0]
    y = points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y, points[..., 2]], axis=-1)


def arm_of(
    tracks: Sequence[ArmTrack],
    *,
    height_m: float = BODY_HEIGHT_M,
    mass_kg: float = BODY_MASS_KG,
    convention: str = YAW_PITCH.name,
) -> ArmModel:
    """The arm of a person: lengths as measured (medians over all samples), masses by anthropometry.

    Raises:
        DataError: when shoulder, elbow and wrist are never seen together.
    """
    points = np.concatenate([track.keypoints[:, :3] for track in tracks])
    points = points[np.isfinite(points).all(axis=(1, 2))]
    if not len(points):
        raise DataError(
            "shoulder, elbow and wrist are never seen together", expected="a usable track"
        )
    upper, forearm = np.median(np.linalg.norm(np.diff(points, axis=1), axis=2), axis=0)
    return ArmModel.of_body(
        height_m, mass_kg, upper_m=float(upper), forearm_m=float(forearm), convention=convention
    )


def seen_between(track: ArmTrack, begin_s: float, end_s: float) -> tuple[Array, Array]:
    """Times (N,) [s] and points (N, 3, 3) [m] where shoulder, elbow and wrist are seen together.

    Args:
        track: A recording; it may be long: no more of it is looked at than that part.
        begin_s: From then on, on the track's clock.
        end_s: Until then.
    """
    part = slice(
        np.searchsorted(track.time_s, begin_s), np.searchsorted(track.time_s, end_s, side="right")
    )
    times, points = track.time_s[part], track.keypoints[part, :3]
    seen = np.isfinite(points).all(axis=(1, 2))
    return times[seen], points[seen]


def observe(
    track: ArmTrack,
    onset_s: float,
    end_s: float,
    arm: ArmModel,
    *,
    facing_rad: float,
    limits: JointLimits = ANATOMICAL,
    trim: bool = True,
    name: str = "",
) -> ObservedReach:
    """One reach of a recording.

    Joint angles are those of the model that come nearest to elbow and wrist, smoothed by least-squares
    splines, from which velocities at both ends are taken. The reach does not begin at rest: where its
    hand has 5 % of the peak speed its joints already turn, and to assume that they do not puts weights
    off by up to 0.5.

    Args:
        track: With shoulder, elbow and wrist.
        onset_s: Where the reach begins, on the track's clock.
        end_s: Where it ends.
        arm: The person's.
        facing_rad: Where the person faces in the axes of the track, from x towards y.
        limits: Of the joints: angles that are nearest to what was seen keep them.
        trim: Whether to cut it to where the hand has 5 % of its peak speed or more.
        name: For reports.

    Raises:
        DataError: too little is seen of it, or it has no length.
    """
    what = name or track.source or track.task or "the reach"
    times, keypoints = seen_between(track, onset_s - MARGIN_S, end_s + MARGIN_S)
    within = times[(times >= onset_s - 1e-9) & (times <= end_s + 1e-9)]
    gaps = np.diff(np.concatenate([[onset_s], within, [end_s]]))
    if len(within) < 10 or gaps.max() > MAX_GAP_S:
        raise DataError(
            f"{what}: shoulder, elbow and wrist are seen together {len(within)} times from {onset_s:.2f} "
            f"to {end_s:.2f} s, with a gap of {gaps.max():.2f} s",
            expected=f"10 times or more, without gaps of more than {MAX_GAP_S} s",
        )
    # Splines say nothing of what is beyond the samples that they were made of.
    onset_s, end_s = max(onset_s, float(times[0])), min(end_s, float(times[-1]))
    points = to_model(keypoints, facing_rad, track.side)
    angles = nearest_angles(points, arm, limits)
    spline = smoothing_spline(times, angles)
    rate = 1.0 / float(np.median(np.diff(times)))
    begin, finish = onset_s, end_s
    if trim:
        begin, finish = _fast_part(spline, arm, onset_s, end_s)
        _check_whole(spline, arm, track, (onset_s, end_s), what)
    count = max(round((finish - begin) * rate) + 1, 10)
    at = np.linspace(begin, finish, count)
    smooth = np.clip(spline(at), limits.lower, limits.upper)
    velocity = spline.derivative()
    problem = ReachProblem.moving(
        smooth[0], smooth[-1], finish - begin, velocity(begin), velocity(finish)
    )
    kept = (times >= begin) & (times <= finish)
    return ObservedReach(
        problem,
        np.linspace(0.0, 1.0, count),
        smooth,
        hand(smooth, arm),
        name,
        _misfit(points[kept], angles[kept], arm),
    )


def at_rest(reach: ObservedReach) -> ObservedReach:
    """The same reach, known to begin and to end at rest."""
    problem = reach.problem
    return replace(
        reach, problem=ReachProblem.at_rest(problem.q_start, problem.q_end, problem.duration)
    )


def _misfit(points: Array, angles: Array, arm: ArmModel) -> float:
    """Root mean square distance of elbow and wrist from where the model has them [m]."""
    if not len(points):
        return 0.0
    elbow, wrist = elbow_and_wrist(angles, arm)
    apart = np.concatenate(
        [elbow + points[:, 0] - points[:, 1], wrist + points[:, 0] - points[:, 2]]
    )
    return float(np.sqrt(np.square(apart).sum(axis=1).mean()))


def smoothing_spline(times: Array, values: Array, knot_s: float = KNOT_S) -> BSpline:
    """Least-squares quintic spline through values (N, d) at times (N,), with knots about so far apart."""
    pieces = max(round((times[-1] - times[0]) / knot_s), 1)
    pieces = min(pieces, max(len(times) // 2 - _DEGREE, 1))
    inner = np.linspace(times[0], times[-1], pieces + 1)[1:-1]
    knots = np.concatenate([[times[0]] * (_DEGREE + 1), inner, [times[-1]] * (_DEGREE + 1)])
    return make_lsq_spline(times, values, knots, _DEGREE)


def _check_whole(
    spline: BSpline, arm: ArmModel, track: ArmTrack, ends: tuple[float, float], what: str
) -> None:
    """Refuse a reach whose begin or end was not seen: what is left would pass for a whole one.

    Raises:
        DataError: the hand is fast there, and nothing was seen on the other side.
    """
    around, _ = seen_between(track, ends[0] - _LOOK_S, ends[1] + _LOOK_S)
    middle = int(np.searchsorted(around, 0.5 * sum(ends)))
    gaps = np.diff(around) > MAX_GAP_S
    before, after = np.flatnonzero(gaps[:middle]), np.flatnonzero(gaps[middle:])
    first = around[before[-1] + 1] if len(before) else around[0]
    last = around[middle + after[0]] if len(after) else around[-1]
    at = np.linspace(*ends, 400)
    speed = np.linalg.norm(np.gradient(hand(spline(at), arm), at, axis=0), axis=1)
    for name, fast, seen_s, gap in (
        ("begins", speed[0], ends[0] - first, len(before)),
        ("ends", speed[-1], last - ends[1], len(after)),
    ):
        share = fast / speed.max()
        if seen_s < _SEEN_S and share > (_AFTER_GAP if gap else _IN_FLIGHT):
            raise DataError(
                f"{what} {name} with {share:.0%} of its peak speed: the rest was not seen",
                expected="a reach from rest to rest",
            )


def _fast_part(spline: BSpline, arm: ArmModel, begin: float, end: float) -> tuple[float, float]:
    """From where to where the hand has a share of its peak speed, around the peak."""
    at = np.linspace(begin, end, 400)
    speed = np.linalg.norm(np.gradient(hand(spline(at), arm), at, axis=0), axis=1)
    peak = int(speed.argmax())
    slow = speed < SHARE_OF_PEAK * speed[peak]
    before, after = np.flatnonzero(slow[:peak]), np.flatnonzero(slow[peak:])
    return (
        float(at[before[-1]]) if len(before) else begin,
        float(at[peak + after[0]]) if len(after) else end,
    )


def from_rest(reach: ReachProblem, share: float = CUT_SHARE) -> ReachProblem:
    """The reach from rest to rest that one was cut out of, between the same postures.

    Weights of costs mean nothing without scale factors, and factors of a reach that was cut are others (by
    up to four times) than those of the whole. Where weights of several reaches are learnt from, or are used
    for another one, they are those of reaches from rest to rest.

    Args:
        reach: As it was seen; one that is at rest at both ends stays what it is.
        share: Of the whole duration that it takes.
    """
    if not (reach.v_start.any() or reach.v_end.any()):
        return reach
    return ReachProblem.at_rest(reach.q_start, reach.q_end, reach.duration / share)


def farthest_ends(reaches: Sequence[ObservedReach]) -> tuple[float, float]:
    """How far a begin, and an end, is from the mean of all at most [m]: repetitions are near to it."""
    begin, end = (
        float(np.linalg.norm(ends - ends.mean(axis=0), axis=1).max())
        for ends in (np.array([each.hand[index] for each in reaches]) for index in (0, -1))
    )
    return begin, end


def are_repetitions(reaches: Sequence[ObservedReach]) -> bool:
    """Whether all of them begin and end in nearly the same place."""
    return max(farthest_ends(reaches)) <= _ALIKE_M


def mean_of(reaches: Sequence[ObservedReach], arm: ArmModel, name: str = "") -> ObservedReach:
    """The mean of repetitions of a reach, by phase: joint angles, velocities at both ends, durations.

    Raises:
        DataError: there are none, some begin at rest and some do not, or their ends are far apart.
    """
    if not reaches:
        raise DataError("no repetitions to take the mean of", expected="one or more")
    for apart, where in zip(farthest_ends(reaches), ("begin", "end"), strict=True):
        if apart > _ALIKE_M:
            raise DataError(
                f"{name or 'repetitions'}: one {where}s {100.0 * apart:.0f} cm from the mean of all",
                expected=f"repetitions of one reach, within {100.0 * _ALIKE_M:.0f} cm",
            )
    count = max(len(each.phases) for each in reaches)
    phases = np.linspace(0.0, 1.0, count)
    angles = np.mean([_at(each, phases) for each in reaches], axis=0)
    problems = [each.problem for each in reaches]
    if len({problem.a_start is None for problem in problems}) > 1:
        raise DataError(
            "repetitions of which some begin at rest", expected="all cut in the same way"
        )
    duration = float(np.mean([problem.duration for problem in problems]))
    # Velocities by phase are what the mean path begins with.
    v_start, v_end = (
        np.mean([getattr(problem, end) * problem.duration for problem in problems], axis=0)
        / duration
        for end in ("v_start", "v_end")
    )
    problem = replace(
        problems[0],
        q_start=angles[0],
        q_end=angles[-1],
        duration=duration,
        v_start=v_start,
        v_end=v_end,
    )
    misfit = float(np.sqrt(np.mean([each.misfit_m**2 for each in reaches])))
    return ObservedReach(
        problem, phases, angles, hand(angles, arm), name or reaches[0].name, misfit
    )


def _at(reach: ObservedReach, phases: Array) -> Array:
    return np.column_stack(
        [np.interp(phases, reach.phases, reach.angles[:, joint]) for joint in range(3)]
    )
