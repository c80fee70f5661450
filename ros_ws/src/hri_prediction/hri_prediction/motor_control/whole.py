"""Reaches from rest to rest in recordings, with some rest before and after."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.kinematics import hand
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.seen import MARGIN_S, MAX_GAP_S, at_rest, observe, seen_between
from hri_prediction.motor_control.span import Span
from hri_prediction.tracks.bell import from_rest_to_rest, share_outside
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

CLEAR_SHARE = 0.1
"""At that share of its peak speed a hand is seen to move, whatever the noise: 5 % drowns in 3 mm of it.
How long it has moved by then is known from the bell-shaped speed of reaches."""
REST_S = 0.12
"""So much rest before and after a reach is looked at [s]."""
LOOKED_S = 0.5
"""So long before and after its labels a reach is looked for [s]."""
LEAST_REST_S = 0.03
"""With less rest than that nobody can tell that a hand has come to rest [s]."""


@dataclass(frozen=True, eq=False)
class WholeReach:
    """A reach that begins and ends at rest.

    Attributes:
        seen: All that is looked at, from some rest before to some rest after.
        span: Phases of that at about which the hand sets out and comes to rest.
        between: The reach between the two.
        begin_s: When the hand sets out at about, on the track's clock.
    """

    seen: ObservedReach
    span: Span
    between: ObservedReach
    begin_s: float


def observe_whole(
    track: ArmTrack,
    onset_s: float,
    end_s: float,
    arm: ArmModel,
    *,
    facing_rad: float,
    limits: JointLimits = ANATOMICAL,
    name: str = "",
) -> WholeReach:
    """One reach of a recording, from rest to rest.

    Args:
        track: With shoulder, elbow and wrist.
        onset_s: Where the reach begins at about, on the track's clock.
        end_s: Where it ends at about.
        arm: The person's.
        facing_rad: Where the person faces in the axes of the track, from x towards y.
        limits: Of the joints.
        name: For reports.

    Raises:
        DataError: too little is seen of it, or no rest before or after it.
    """
    what = name or track.source or track.task or "the reach"
    times, _ = seen_between(track, onset_s - LOOKED_S, end_s + LOOKED_S)
    if not len(times):
        raise DataError(
            f"{what}: nothing is seen from {onset_s:.2f} to {end_s:.2f} s", expected="a reach"
        )
    # Of neighbouring movements as much is looked at as was seen without a gap.
    first, last = _unbroken(times, onset_s, end_s)
    wide = observe(
        track, first, last, arm, facing_rad=facing_rad, limits=limits, trim=False, name=name
    )
    # It begins with the first sample, where that is a little after what was asked for.
    first = max(first, float(times[np.searchsorted(times, first - MARGIN_S)]))
    at = first + wide.phases * wide.problem.duration
    begin, end, still = _ends(at, wide, (onset_s, end_s), what)
    # Another movement may begin right after it.
    start, finish = max(begin - REST_S, still[0]), min(end + REST_S, still[1])
    for where, rest in (("before", begin - start), ("after", finish - end)):
        if rest < LEAST_REST_S:
            raise DataError(
                f"{what}: {max(rest, 0.0):.2f} s of rest are seen {where} it, as its smoothed speed says",
                expected=f"{LEAST_REST_S} s or more, to know that it goes from rest to rest",
                hint="leave out --whole, or record longer",
            )
    inside = (at >= start) & (at <= finish)
    angles, known = wide.angles[inside], at[inside]
    length = float(known[-1] - known[0])
    ends = (angles[known <= begin], angles[known >= end])
    q_start, q_end = (
        np.clip(each.mean(axis=0), limits.lower, limits.upper) if len(each) else angles[index]
        for each, index in zip(ends, (0, -1), strict=True)
    )
    seen = replace(
        wide,
        problem=ReachProblem.at_rest(q_start, q_end, length),
        phases=(known - known[0]) / length,
        angles=angles,
        hand=hand(angles, arm),
    )
    span = ((begin - known[0]) / length, (end - known[0]) / length)
    between = observe(
        track, begin, end, arm, facing_rad=facing_rad, limits=limits, trim=False, name=name
    )
    return WholeReach(seen, span, at_rest(between), begin)


def _unbroken(times: Array, onset_s: float, end_s: float) -> tuple[float, float]:
    """First and last time, around a reach, without a long gap between."""
    breaks = np.flatnonzero(np.diff(times) > MAX_GAP_S)
    before = breaks[times[breaks + 1] <= onset_s]
    after = breaks[times[breaks] >= end_s]
    first = times[before[-1] + 1] if len(before) else times[0]
    last = times[after[0]] if len(after) else times[-1]
    return float(min(first, onset_s)), float(max(last, end_s))


def _ends(
    at: Array, seen: ObservedReach, labels: tuple[float, float], what: str
) -> tuple[float, float, tuple[float, float]]:
    """When the hand sets out and comes to rest at about, and from when to when it does nothing else [s].

    Raises:
        DataError: it does not come to rest on either side.
    """
    speed = np.linalg.norm(np.gradient(seen.hand, at, axis=0), axis=1)
    inside = (at >= labels[0]) & (at <= labels[1])
    peak = int(np.where(inside, speed, 0.0).argmax())
    slow = speed < CLEAR_SHARE * speed[peak]
    before, after = np.flatnonzero(slow[:peak]), peak + np.flatnonzero(slow[peak:])
    for where, found, beside in (
        ("before", before, speed[: peak + 1]),
        ("after", after, speed[peak:]),
    ):
        if not len(found):
            raise DataError(
                f"{what}: {where} it the hand is never slower than {beside.min() / speed[peak]:.0%} of "
                "its peak speed",
                expected=f"rest, with --whole: less than {CLEAR_SHARE:.0%}",
                hint="leave out --whole",
            )
    crossed, left = float(at[before[-1]]), float(at[after[0]])
    outside = float(share_outside(CLEAR_SHARE) * from_rest_to_rest(left - crossed, CLEAR_SHARE))
    fast = np.flatnonzero(~slow)
    earlier, later = fast[fast < before[-1]], fast[fast > after[0]]
    still = (
        float(at[earlier[-1] + 1]) if len(earlier) else float(at[0]),
        float(at[later[0] - 1]) if len(later) else float(at[-1]),
    )
    return crossed - outside, left + outside, still
