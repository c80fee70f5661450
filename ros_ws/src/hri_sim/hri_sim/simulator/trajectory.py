"""A joint trajectory as a controller receives it, what makes one acceptable, and how one is joined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_prediction.errors import DataError
from hri_sim.simulator import splines

FloatArray = NDArray[np.float64]

REST_SPEED = 0.01
"""A trajectory must end slower than this [rad/s]."""
_SLACK = 1e-6  # positions may touch a limit up to rounding [rad]


@dataclass(frozen=True)
class JointTrajectory:
    """trajectory_msgs/JointTrajectory without ROS.

    Attributes:
        stamp_ns: When time 0 of the trajectory is [ns]; 0 means: as soon as it arrives.
        joint_names: Names of the columns, in any order.
        time_s: Times from the stamp (N,) [s], increasing.
        positions: (N, 7) [rad].
        velocities: (N, 7) [rad/s], or None: straight lines between the points.
        accelerations: (N, 7) [rad/s^2], or None: cubic instead of quintic splines.
    """

    stamp_ns: int
    joint_names: tuple[str, ...]
    time_s: FloatArray
    positions: FloatArray
    velocities: FloatArray | None = None
    accelerations: FloatArray | None = None


@dataclass(frozen=True)
class SplinePath:
    """A checked trajectory in the robot's joint order; see :mod:`hri_sim.simulator.splines`.

    Attributes:
        stamp_ns: Clock time of path time 0 [ns].
        knots: (S + 1,) [s].
        coefficients: (S, 7, 6).
        smooth: Whether accelerations were given (quintic).
    """

    stamp_ns: int
    knots: FloatArray
    coefficients: FloatArray
    smooth: bool

    def at(self, time_s: float) -> FloatArray:
        """Position, velocity, acceleration (3, 7) at a path time [s]."""
        state = np.empty((3, self.coefficients.shape[1]))
        splines.evaluate(self.knots, self.coefficients, time_s, 0, state)
        return state


def check(trajectory: JointTrajectory, robot: RobotModel) -> SplinePath:
    """Bring a trajectory into the robot's joint order, or say what is wrong with it.

    Raises:
        DataError: on wrong names or sizes, values that are not finite, times that do not increase,
            an end that is not at rest, positions (also between the points) outside the limits.
    """
    names = trajectory.joint_names
    if sorted(names) != sorted(robot.joint_names):
        missing = [name for name in robot.joint_names if name not in names]
        raise DataError(
            f"trajectory has joints {', '.join(names) or '(none)'}"
            + (f" without {', '.join(missing)}" if missing else ""),
            expected=", ".join(robot.joint_names) + " in any order",
        )
    order = [names.index(name) for name in robot.joint_names]
    time_s = np.array(trajectory.time_s, dtype=float)
    if time_s.ndim != 1:
        raise DataError(f"trajectory times have shape {time_s.shape}", expected="(N,)")
    arrays: dict[str, FloatArray] = {}
    for label in ("positions", "velocities", "accelerations"):
        given = getattr(trajectory, label)
        if given is None:
            continue
        values = np.asarray(given, dtype=float)
        if values.shape != (len(time_s), len(names)):
            raise DataError(
                f"trajectory {label} have shape {values.shape}",
                expected=f"({len(time_s)}, {len(names)}), a row a point",
            )
        if not np.isfinite(values).all():
            point, joint = np.argwhere(~np.isfinite(values))[0]
            raise DataError(
                f"trajectory {label} of {names[joint]} at point {point} are {values[point, joint]}",
                expected="finite numbers",
            )
        arrays[label] = values[:, order]
    _check_times(time_s)
    position = arrays["positions"]
    velocity, acceleration = arrays.get("velocities"), arrays.get("accelerations")
    if velocity is not None and (speed := np.abs(velocity[-1])).max() > REST_SPEED:
        joint = int(speed.argmax())
        raise DataError(
            f"trajectory ends with {robot.joint_names[joint]} at {velocity[-1, joint]:.3f} rad/s",
            expected="an end at rest",
        )
    if len(time_s) == 1:
        # A lone goal: the way there is the controller's blend; keep one segment at rest behind it.
        time_s = np.array([time_s[0], time_s[0] + 1e-3])
        position = np.vstack((position, position))
        velocity, acceleration = np.zeros((2, 7)), np.zeros((2, 7))
    if velocity is None:
        coefficients = splines.linear(time_s, position)
    elif acceleration is None:
        coefficients = splines.cubic(time_s, position, velocity)
    else:
        coefficients = splines.quintic(time_s, position, velocity, acceleration)
    check_limits(coefficients, time_s, robot, "trajectory")
    smooth = velocity is not None and acceleration is not None
    return SplinePath(trajectory.stamp_ns, time_s, coefficients, smooth)


def check_limits(coefficients: FloatArray, knots: FloatArray, robot: RobotModel, what: str) -> None:
    """Raise DataError where a path leaves the position limits."""
    low, high = splines.extremes(coefficients, knots)
    if (low >= robot.lower - _SLACK).all() and (high <= robot.upper + _SLACK).all():
        return
    low, high = splines.sampled_extremes(coefficients, knots)
    outside = np.maximum(robot.lower - low, high - robot.upper)
    joint = int(outside.argmax())
    if outside[joint] > _SLACK:
        worst = low[joint] if low[joint] < robot.lower[joint] else high[joint]
        raise DataError(
            f"{what} takes {robot.joint_names[joint]} to {worst:.4f} rad",
            expected=f"{robot.lower[joint]:.4f} to {robot.upper[joint]:.4f} rad",
        )


def _check_times(time_s: FloatArray) -> None:
    if not np.isfinite(time_s).all():
        raise DataError("trajectory times are not finite", expected="seconds from the stamp")
    if time_s[0] < 0.0:
        raise DataError(f"trajectory begins {time_s[0]} s from its stamp", expected="0 or later")
    late = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(late):
        index = int(late[0]) + 1
        raise DataError(
            f"trajectory point {index} at {time_s[index]} s follows one at {time_s[index - 1]} s",
            expected="increasing times",
        )


def joined(
    path: SplinePath, now: float, state: FloatArray, join: float
) -> tuple[FloatArray, FloatArray]:
    """A path that begins now in a given state and follows ``path`` from ``join`` on.

    Args:
        path: The path to join.
        now: Time now on the path's clock [s].
        state: Position, velocity, acceleration now (3, 7), in path time.
        join: Where the blend ends, on the path's clock [s], after now.

    Returns:
        Knots (S + 1,) and coefficients (S, 7, 6).
    """
    later = np.flatnonzero(path.knots[1:] > join)
    target = path.at(join)
    times = np.array([now, join])
    position, velocity, acceleration = (np.stack(pair) for pair in zip(state, target, strict=True))
    if path.smooth:
        blend = splines.quintic(times, position, velocity, acceleration)
    else:
        blend = splines.cubic(times, position, velocity)
    if not len(later):
        return times, blend
    segment = int(later[0])
    rest = path.coefficients[segment:].copy()
    rest[0] = _shifted(rest[0], join - float(path.knots[segment]))
    knots = np.concatenate((times, path.knots[segment + 1 :]))
    return knots, np.ascontiguousarray(np.concatenate((blend, rest)))


def _shifted(coefficients: FloatArray, offset: float) -> FloatArray:
    """Coefficients (7, 6) of the same polynomials about a later origin [s]."""
    if offset == 0.0:
        return coefficients
    result = coefficients.copy()
    # Repeated synthetic division: Taylor shift.
    for start in range(splines.DEGREES - 1):
        for k in range(splines.DEGREES - 2, start - 1, -1):
            result[:, k] += offset * result[:, k + 1]
    return result
