"""Between messages and the planner's dataclasses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Duration
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hri_planner.ptomp.forecast import HumanForecast, forecast_of
from hri_planner.ptomp.plan import JointPlan
from hri_prediction.arm.geometry import SIDES
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import WORLD, flat
from hri_prediction.ros.messages import ControllerState, HumanPrediction
from hri_prediction.ros.time import NANO, to_ns, to_time

FloatArray = NDArray[np.float64]


def forecast_from_message(
    message: HumanPrediction, origin_ns: int, radii: FloatArray
) -> HumanForecast:
    """Forecast of a prediction, on a plan clock that is zero at ``origin_ns``.

    Args:
        message: A prediction that is not INVALID.
        origin_ns: Zero of the plan clock on the ROS clock [ns].
        radii: Of upper arm, forearm and hand (3,) [m].

    Raises:
        DataError: on another frame, wrong sizes, other times than equal steps from 0 on, or values that
            are not finite.
    """
    if message.header.frame_id != WORLD:
        raise DataError(
            f"prediction of {message.body_id!r} is in frame {message.header.frame_id!r}",
            expected=f"frame {WORLD!r}",
        )
    count = len(message.times)
    if count < 2 or len(message.mean) != count * 12 or len(message.covariance) != count * 36:
        raise DataError(
            f"prediction of {message.body_id!r} has {count} times, {len(message.mean)} means and "
            f"{len(message.covariance)} covariances",
            expected="K >= 2 times, 12 K means, 36 K covariances",
        )
    times = np.asarray(message.times, dtype=float)
    if not _even(times):
        raise DataError(
            f"prediction of {message.body_id!r} is for {times[0]:g}, {times[1]:g} ... {times[-1]:g} s",
            expected="0 first, and equal steps from each to the next",
        )
    covariance = np.asarray(message.covariance, dtype=float).reshape(count, 4, 3, 3)
    if not np.isfinite(covariance).all():
        raise DataError(f"prediction of {message.body_id!r} has covariances that are not finite")
    return forecast_of(
        (to_ns(message.header.stamp) - origin_ns) / NANO,
        times,
        np.asarray(message.mean, dtype=float).reshape(count, 4, 3),
        covariance,
        radii,
    )


def _even(times: FloatArray) -> bool:
    """Whether times begin with 0 and go on in equal steps, but for rounding."""
    if not np.isfinite(times).all():
        return False
    steps = np.diff(times)
    begins = abs(times[0]) < 1e-6 < steps[0]
    return bool(begins and np.allclose(steps, steps[0], rtol=1e-3, atol=0.0))


def check_side(message: HumanPrediction) -> None:
    """Refuse a prediction that does not say which arm it is of.

    Raises:
        DataError: when its side is none.
    """
    if message.side not in SIDES:
        raise DataError(
            f"prediction of {message.body_id!r} has side {message.side!r}",
            expected=" or ".join(map(repr, SIDES)),
        )


def trajectory_message(
    plan: JointPlan, joint_names: tuple[str, ...], handover_ns: int
) -> JointTrajectory:
    """Trajectory whose first point is due at ``handover_ns``."""
    message = JointTrajectory(
        header=Header(stamp=to_time(handover_ns)), joint_names=list(joint_names)
    )
    for time_s, q, qd, qdd in zip(
        plan.time_s - plan.time_s[0], plan.q, plan.qd, plan.qdd, strict=True
    ):
        seconds, nanoseconds = divmod(round(float(time_s) * 1e9), NANO)
        message.points.append(
            JointTrajectoryPoint(
                positions=flat(q),
                velocities=flat(qd),
                accelerations=flat(qdd),
                time_from_start=Duration(sec=seconds, nanosec=nanoseconds),
            )
        )
    return message


def end_message(plan: JointPlan, joint_names: tuple[str, ...]) -> JointTrajectory:
    """Trajectory from now on to the end of a plan, to rest there: one point, so that none need follow."""
    seconds, nanoseconds = divmod(round(float(plan.time_s[-1] - plan.time_s[0]) * 1e9), NANO)
    rest = JointTrajectoryPoint(
        positions=flat(plan.q[-1]),
        velocities=[0.0] * len(joint_names),
        accelerations=[0.0] * len(joint_names),
        time_from_start=Duration(sec=seconds, nanosec=nanoseconds),
    )
    return JointTrajectory(joint_names=list(joint_names), points=[rest])


def joints_from_message(
    message: JointState, joint_names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Positions and velocities (7,) in the order of ``joint_names``, whatever the message's order.

    Raises:
        DataError: when a joint is missing, or a value is missing or not finite.
    """
    return _in_order("/joint_states", message.name, message.position, message.velocity, joint_names)


def reference_from_message(
    message: ControllerState, joint_names: tuple[str, ...]
) -> ControllerState:
    """The controller's reference with its joints in the order of ``joint_names``, and no others.

    Raises:
        DataError: when a joint is missing, or a value is missing or not finite.
    """
    q, qd = _in_order(
        "the controller's reference",
        message.joint_names,
        message.reference_position,
        message.reference_velocity,
        joint_names,
    )
    for name in ("time_in_trajectory", "speed_scale", "handover_jump", "max_handover_jump"):
        if not math.isfinite(value := getattr(message, name)):
            raise DataError(f"the controller's reference has {name} = {value}")
    message.joint_names = list(joint_names)
    message.reference_position, message.reference_velocity = flat(q), flat(qd)
    return message


def _in_order(
    what: str,
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float],
    joint_names: tuple[str, ...],
) -> tuple[FloatArray, FloatArray]:
    try:
        order = [names.index(name) for name in joint_names]
    except ValueError:
        raise DataError(
            f"{what} has joints {', '.join(names) or '(none)'}",
            expected=", ".join(joint_names) + " among them",
        ) from None
    size = len(names)
    if len(position) != size or len(velocity) != size:
        raise DataError(
            f"{what} has {size} names, {len(position)} positions and {len(velocity)} velocities",
            expected="as many of each",
        )
    q = np.asarray(position, dtype=float)[order]
    qd = np.asarray(velocity, dtype=float)[order]
    if not (np.isfinite(q).all() and np.isfinite(qd).all()):
        raise DataError(f"{what} holds numbers that are not finite")
    return q, qd
