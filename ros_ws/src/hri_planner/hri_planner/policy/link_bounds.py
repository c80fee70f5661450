"""Bounds on the tool's acceleration that keep all links of the robot out of boxes: compiled.

The filter of :mod:`hri_planner.policy.separation` knows the tool. With n the direction from a box to the
point p of a link that is next to it, and the joints' speeds J⁺ v for a velocity v of the tool, the point
leaves the box at n·J_p J⁺ v = u·v: along u the tool's acceleration decides whether the link stops before
the box. What the null space adds is in the speeds that are measured, not in u.

A link that is too near to begin with is kept from coming nearer; it is not driven away, as the tool may
have nowhere to go for it. How near all links came to boxes is said afterwards.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.separation import from_box, least_gentle, least_outward
from hri_planner.robot.kinematics import arm_points, point_jacobian, tool_jacobian
from hri_planner.robot.model import RobotModel
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

LINKS = 3
"""Upper arm, lower arm and hand."""
_SECTIONS = 24
_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)
_FAR_M = 0.5
"""Links are no nearer within the steps that are looked ahead."""
_DAMPING_M = 0.05
_TOOL_FROM = 0.999
"""From here on the hand's end is the tool."""
_NO_SAY = 0.2
"""Below this |u| the tool's motion does not decide the link's."""


@njit
def link_bounds(
    q: Any,
    qd: Any,
    lengths: Any,
    boxes: Any,
    margins: Any,
    dt: float,
    most: float,
    approach: float,
    outward: Any,
    least: Any,
) -> None:
    """Half-spaces of accelerations, outward · a >= least, for each box and link.

    Args:
        q: Joint angles (7,) [rad].
        qd: Their speeds (7,) [rad/s].
        lengths: Of the robot (4,) [m].
        boxes: Centre and half the size (k, 2, 3) [m].
        margins: Distance of the links' axes that is kept, upper arm first (3,) [m].
        dt: Time for which the acceleration holds [s].
        most: Largest acceleration of the tool [m/s²].
        approach: Share of the room that may be used up a second [1/s].
        outward: Result (3k, 3).
        least: Result (3k,) [m/s²]; -inf where nothing is asked.
    """
    outward[:], least[:] = 0.0, -np.inf
    points, away = np.empty((4, 3)), np.empty(3)
    arm_points(q, lengths, points)
    tool, jacobian = np.empty(3), np.empty((3, 7))
    point, own = np.empty(3), np.empty((3, 7))
    tool_jacobian(q, lengths, tool, jacobian)
    squared = jacobian @ jacobian.T + _DAMPING_M**2 * np.eye(3)
    for index in range(len(boxes)):
        for link in range(LINKS):
            first = points[link]
            way = points[link + 1] - first
            share = _nearest_share(first, way, boxes[index], away)
            if link == LINKS - 1 and share > _TOOL_FROM:
                continue  # the tool's own bound says it exactly
            room = from_box(first + share * way, boxes[index], away) - margins[link]
            if room > _FAR_M:
                continue
            point_jacobian(q, lengths, link, share, point, own)
            row = away @ own
            along = np.linalg.solve(squared, jacobian @ row)
            size = math.sqrt(np.sum(along**2))
            if size < _NO_SAY:
                continue
            closing = -np.sum(row * qd)
            room, able = max(room, 0.0), size * most
            bound = LINKS * index + link
            outward[bound] = along / size
            needed = max(
                least_gentle(room, closing, able, 0.0, approach),
                least_outward(room, closing, dt, able, 0.0),
            )
            least[bound] = needed / size


def box_clearance(robot: RobotModel, joints: FloatArray, boxes: FloatArray) -> float:
    """Smallest distance of the robot's capsules, for angles (n, 7) [rad], from boxes (k, 2, 3) [m].

    Negative where they overlap, infinite without boxes or angles.
    """
    return float(
        _box_clearance(
            np.array(joints, dtype=float, order="C"),
            robot.lengths,
            robot.capsule_radii,
            np.array(boxes, dtype=float, order="C"),
        )
    )


@njit
def _box_clearance(joints: Any, lengths: Any, radii: Any, boxes: Any) -> float:
    points, away, smallest = np.empty((4, 3)), np.empty(3), np.inf
    for index in range(len(joints)):
        arm_points(joints[index], lengths, points)
        for box in range(len(boxes)):
            for link in range(len(radii)):
                first = points[link]
                way = points[link + 1] - first
                share = _nearest_share(first, way, boxes[box], away)
                gap = from_box(first + share * way, boxes[box], away) - radii[link]
                smallest = min(smallest, gap)
    return smallest


@njit
def _nearest_share(first: Any, way: Any, box: Any, away: Any) -> float:
    """Where along a segment, 0 to 1, it is next to a box: distances to what is convex are convex."""
    low, high = 0.0, 1.0
    s, t = 1.0 - _RATIO, _RATIO
    at_s = from_box(first + s * way, box, away)
    at_t = from_box(first + t * way, box, away)
    for _ in range(_SECTIONS):
        if at_s <= at_t:
            high, t, at_t = t, s, at_s
            s = high - _RATIO * (high - low)
            at_s = from_box(first + s * way, box, away)
        else:
            low, s, at_s = s, t, at_t
            t = low + _RATIO * (high - low)
            at_t = from_box(first + t * way, box, away)
    return 0.5 * (low + high)
