"""What a goal of the ReachTarget action asks for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray

from hri_prediction.errors import PlanningError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import ReachTarget
from hri_prediction.ros.time import NANO, to_ns

FloatArray = NDArray[np.float64]

DURATIONS_S = (0.1, 60.0)
"""Durations that a goal may ask for [s]."""


def target_of(goal: ReachTarget.Goal, targets: Mapping[str, FloatArray]) -> FloatArray:
    """Tool position (3,) [m] of a goal.

    Args:
        goal: The goal.
        targets: Positions (3,) [m] of the targets that it may name.

    Raises:
        PlanningError: when it is malformed.
    """
    low, high = DURATIONS_S
    if goal.duration != 0.0 and not low <= goal.duration <= high:
        raise PlanningError(
            f"goal duration {goal.duration} s", expected=f"{low} to {high} s, or 0: the default"
        )
    if goal.target:
        if goal.target not in targets:
            raise PlanningError(
                f"there is no target {goal.target!r}",
                expected=", ".join(targets) or "a pose: no named targets are configured",
            )
        return targets[goal.target].copy()
    return position_of(goal.pose)


def moving_position_of(pose: PoseStamped, now_ns: int, max_age_s: float) -> FloatArray:
    """Position (3,) [m] of a goal that moves, unless that is an old one.

    Args:
        pose: Where it is; without a stamp: now.
        now_ns: Time [ns].
        max_age_s: It may be so old, or so much in the future [s].

    Raises:
        PlanningError: when it is too old, or malformed.
    """
    stamp_ns = to_ns(pose.header.stamp)
    age_s = (now_ns - stamp_ns) / NANO
    if stamp_ns and abs(age_s) > max_age_s:
        raise PlanningError(
            f"goal on policy/goal is {age_s:.2f} s old",
            expected=f"{max_age_s:g} s at most",
            hint="compare the clocks, or leave the stamp zero: now",
        )
    return position_of(pose)


def position_of(pose: PoseStamped) -> FloatArray:
    """Position (3,) [m] of a pose that the tool is to take.

    Raises:
        PlanningError: when its frame is unknown, or it is not finite.
    """
    if pose.header.frame_id not in ("", WORLD, "lwr_base"):
        raise PlanningError(
            f"goal is in frame {pose.header.frame_id!r}", expected="world or lwr_base"
        )
    position = pose.pose.position
    target = np.array([position.x, position.y, position.z])
    if not np.isfinite(target).all():
        raise PlanningError(f"goal position {target.tolist()}", expected="finite numbers [m]")
    return target
