"""Joint speeds that give the tool a velocity: damped least squares, within all limits.

Damped where the tool's Jacobian loses rank (Nakamura & Hanafusa 1986), only in the directions that are
lost (Chiaverini 1997) and the more, the faster the tool is to move in them: a way that can be gone is
followed, and one beyond the robot's reach leaves the arm still, not trembling. What damping takes from
the tool is left to the rest, so that an arm that stands straight bends again. Joints that would pass a
limit of angle, speed or acceleration stay at it while the others take over (saturation in the null
space, Flacco et al. 2012). What is left of the seven joints moves the robot's point next to an obstacle
away from it, which is one dimension of motion, along the line between them (as in the thesis's equation
7.18, but damped, one-dimensional and one-sided: where the tool's motion already takes the point away,
nothing is added); and keeps to the middle of the joints' ranges, or to a posture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.rest import LIMIT_MARGIN
from hri_planner.robot.kinematics import tool_jacobian
from hri_planner.robot.model import RobotModel
from hri_prediction.compiled import njit
from hri_prediction.config import parameter, validate

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ToolVelocityConfig:
    """Parameters of the inverse kinematics.

    Raises:
        ConfigError: when a value is out of range.
    """

    feedback: float = parameter(
        10.0, "share of the tool's position error that is made up a second", unit="1/s", low=0.0
    )
    damping: float = parameter(
        0.005, "damping at a singularity in whose direction the tool is to rest", unit="m", low=0.0
    )
    near_singular: float = parameter(
        0.10, "singular value of the Jacobian from which on its direction is not damped", unit="m",
        low=1e-6,
    )  # fmt: skip
    centring: float = parameter(
        1.0, "share of their distance by which free joints leave their limits, for each metre that the "
        "tool moves", unit="1/m", low=0.0,
    )  # fmt: skip
    speed_share: float = parameter(
        0.9, "share of the joints' speed limits that is used", low=0.05, high=1.0
    )
    joint_acceleration: float = parameter(
        25.0, "largest acceleration of a joint", unit="rad/s^2", low=0.1, high=200.0
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)


SINGULAR_SPEED = 2.0
"""Largest joint speed that the tool's motion asks for in a direction that is lost [rad/s].

With a damping of d² + (v / 2 w)², v the tool's speed in the direction, the joints' s v / (s² + damping)
is w at most, whatever the singular value s.
"""
AWAY_DAMPING_M = 0.05
"""Damping of the motion away from obstacles, where the tool's motion nearly decides it [m]."""
_SAME_TOOL = 1e-7
"""Motions of the tool that differ by less are one [m/s]."""
AWAY_MARGIN = 0.1
"""Making way stops so far before joint limits [rad]."""
AWAY_FASTEST = 2.0
"""No joint gets faster than this to move away from obstacles [rad/s]."""
NOTHING_NEAR: tuple[FloatArray, float] = (np.zeros(7), 0.0)
"""No obstacle that a point of the robot is to be moved away from."""


class ToolVelocity:
    """Inverse kinematics of one robot; buffers are allocated once.

    Args:
        robot: Its model.
        config: Parameters.
        posture: Joint angles (7,) [rad] that free joints keep to; none: the middle of their ranges.
    """

    def __init__(
        self, robot: RobotModel, config: ToolVelocityConfig, posture: FloatArray | None = None
    ) -> None:
        self._robot, self.config = robot, config
        middle = 0.5 * (robot.lower + robot.upper)
        self._posture = middle if posture is None else np.array(posture, dtype=float)
        self._fastest = config.speed_share * robot.velocity
        self._tool, self._jacobian = np.empty(3), np.empty((3, 7))

    def tool(self, q: FloatArray) -> FloatArray:
        """Where the tool is (3,) [m], base frame."""
        tool_jacobian(q, self._robot.lengths, self._tool, self._jacobian)
        return self._tool.copy()

    def tool_motion(self, q: FloatArray, qd: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where the tool is (3,) [m] and its velocity (3,) [m/s], base frame."""
        tool_jacobian(q, self._robot.lengths, self._tool, self._jacobian)
        return self._tool.copy(), self._jacobian @ qd

    def joint_speeds(
        self,
        q: FloatArray,
        qd: FloatArray,
        position: FloatArray,
        velocity: FloatArray,
        dt: float,
        away: tuple[FloatArray, float] = NOTHING_NEAR,
    ) -> FloatArray:
        """Joint speeds for one step.

        Args:
            q: Joint angles (7,) [rad].
            qd: Joint speeds before (7,) [rad/s].
            position: Where the tool should be now (3,) [m], base frame.
            velocity: How it should move (3,) [m/s].
            dt: How long they hold [s].
            away: How a point's distance from an obstacle changes with the joint angles (7,) [m/rad],
                and the speed at which it is to grow [m/s], so far as the tool's motion leaves it.

        Returns:
            Shape (7,) [rad/s]; within the limits of speed and acceleration, and such that braking keeps
            within the joint limits.
        """
        found: FloatArray = joint_speeds(
            q, qd, position, velocity, dt, away[0], away[1], *self.constants
        )
        return found

    @property
    def constants(self) -> tuple[Any, ...]:
        """What :func:`joint_speeds` wants to know of robot and configuration."""
        robot, config = self._robot, self.config
        return (
            robot.lengths,
            robot.lower,
            robot.upper,
            self._fastest,
            config.feedback,
            config.centring,
            config.joint_acceleration,
            config.damping,
            config.near_singular,
            self._posture,
        )


@njit
def joint_speeds(
    q: Any,
    qd: Any,
    position: Any,
    velocity: Any,
    dt: float,
    row: Any,
    away: float,
    lengths: Any,
    lower: Any,
    upper: Any,
    fastest: Any,
    feedback: float,
    centring: float,
    most: float,
    damping: float,
    near: float,
    posture: Any,
) -> Any:
    """Of :meth:`ToolVelocity.joint_speeds` (7,) [rad/s]."""
    tool, jacobian = np.empty(3), np.empty((3, 7))
    tool_jacobian(q, lengths, tool, jacobian)
    wanted = velocity + feedback * (position - tool)
    low, high, aside = np.empty(7), np.empty(7), np.empty(7)
    inner_low, inner_high = np.empty(7), np.empty(7)
    speed = np.sqrt(np.sum(velocity**2))
    for joint in range(7):
        up = _braking(upper[joint] - q[joint] - LIMIT_MARGIN, most, dt, fastest[joint])
        down = -_braking(q[joint] - lower[joint] - LIMIT_MARGIN, most, dt, fastest[joint])
        # A joint that is too quick already brakes as it can.
        low[joint] = max(down, min(qd[joint] - most * dt, up))
        high[joint] = min(up, max(qd[joint] + most * dt, down))
        # What makes way keeps farther from the limits, and leaves half of the braking.
        room = upper[joint] - q[joint] - AWAY_MARGIN
        inner_high[joint] = min(high[joint], _braking(room, 0.5 * most, dt, AWAY_FASTEST))
        room = q[joint] - lower[joint] - AWAY_MARGIN
        inner_low[joint] = max(low[joint], -_braking(room, 0.5 * most, dt, AWAY_FASTEST))
        # No faster than the tool: a robot at rest stays at rest.
        aside[joint] = centring * speed * (posture[joint] - q[joint])
    return _saturated(
        jacobian, wanted, aside, low, high, inner_low, inner_high, fastest, damping, near, row, away
    )


@njit
def _braking(room: float, most: float, dt: float, fastest: float) -> float:
    """Largest speed from which a joint comes to rest in front of its limit: v dt + v² / (2 a) = room."""
    found = np.sqrt((most * dt) ** 2 + 2.0 * most * max(room, 0.0)) - most * dt
    return min(found, fastest)


@njit
def _saturated(
    jacobian: Any,
    wanted: Any,
    aside: Any,
    low: Any,
    high: Any,
    inner_low: Any,
    inner_high: Any,
    fastest: Any,
    damping: float,
    near: float,
    row: Any,
    away: float,
) -> Any:
    """Speeds of all joints (7,), those that would be over a limit at it.

    The tool comes first: if its motion is another one with what makes way than without, by limits that
    joints come to, they only go as far that way as leaves it.
    """
    nothing = np.zeros(7)
    plain = _within(jacobian, wanted, aside, low, high, fastest, damping, near, nothing, 0.0)
    growing = np.sum(row * plain)
    if not away > growing:
        return plain
    # Stretched out the tool's motion needs all joints: then they make way the less.
    smallest = np.linalg.svd(jacobian, full_matrices=False)[1][2]
    away = growing + min(0.5 * smallest / near, 1.0) ** 2 * (away - growing)
    least, most = np.minimum(plain, inner_low), np.maximum(plain, inner_high)
    given = _within(jacobian, wanted, aside, least, most, fastest, damping, near, row, away)
    missed = math.sqrt(np.sum((jacobian @ plain - wanted) ** 2))
    if math.sqrt(np.sum((jacobian @ given - wanted) ** 2)) <= missed + _SAME_TOOL:
        return given
    # In the null space of the tool's motion, as far as the first joint gets to a limit.
    step, share = _tool_still(jacobian, given - plain), 1.0
    for joint in range(7):
        if step[joint] > 1e-12:
            share = min(share, max(most[joint] - plain[joint], 0.0) / step[joint])
        elif step[joint] < -1e-12:
            share = min(share, max(plain[joint] - least[joint], 0.0) / -step[joint])
    if np.sum(row * step) <= 0.0:
        return plain
    return plain + share * step


@njit
def _within(
    jacobian: Any,
    wanted: Any,
    aside: Any,
    low: Any,
    high: Any,
    fastest: Any,
    damping: float,
    near: float,
    row: Any,
    away: float,
) -> Any:
    """Speeds within limits: joints that would be over are fixed, and the rest is solved again."""
    free, speeds = np.ones(7), np.zeros(7)
    for _ in range(7):
        rest = wanted - jacobian @ ((1.0 - free) * speeds)
        fixed = np.sum((1.0 - free) * row * speeds)
        found = _damped(
            jacobian * free, rest, aside * free, damping, near, row * free, away - fixed
        )
        # The one that is over by most is fixed at its limit.
        worst, most = -1, 0.0
        for joint in range(7):
            over = max(low[joint] - found[joint], found[joint] - high[joint])
            if free[joint] == 1.0 and over > 1e-12 and over / fastest[joint] > most:
                worst, most = joint, over / fastest[joint]
        if worst < 0:
            return free * found + (1.0 - free) * speeds
        speeds[worst] = low[worst] if found[worst] < low[worst] else high[worst]
        free[worst] = 0.0
    return speeds


@njit
def _tool_still(jacobian: Any, speeds: Any) -> Any:
    """What of joint speeds (7,) leaves the tool where it is."""
    _, values, right = np.linalg.svd(jacobian, full_matrices=False)
    left = speeds.copy()
    for k in range(3):
        if values[k] > 1e-6:
            left -= right[k] * np.sum(right[k] * speeds)
    return left


@njit
def _damped(
    jacobian: Any, wanted: Any, pull: Any, damping: float, near: float, row: Any, away: float
) -> Any:
    left, values, right = np.linalg.svd(jacobian, full_matrices=False)
    found, free_row = pull.copy(), row.copy()
    for k in range(3):
        along, pulled, across = 0.0, 0.0, 0.0
        for i in range(3):
            along += left[i, k] * wanted[i]
        close, damped = values[k] / near, 0.0
        if close < 1.0:
            damped = (damping**2 + (0.5 * along / SINGULAR_SPEED) ** 2) * (1.0 - close**2)
        gain = values[k] / max(values[k] ** 2 + damped, 1e-12)
        # What damping takes from the tool's motion is left to the rest.
        kept = values[k] * gain
        for joint in range(7):
            pulled += kept * right[k, joint] * pull[joint]
            across += kept * right[k, joint] * row[joint]
        for joint in range(7):
            found[joint] += right[k, joint] * (gain * along - pulled)
            free_row[joint] -= right[k, joint] * across
    # Making way is one-sided, and damped: where the tool's motion leaves nothing of it, free_row is 0.
    missing, squares = away, 0.0
    for joint in range(7):
        missing -= row[joint] * found[joint]
        squares += free_row[joint] ** 2
    if missing > 0.0 and squares > 0.0:
        for joint in range(7):
            found[joint] += free_row[joint] * missing / (squares + AWAY_DAMPING_M**2)
    return found
