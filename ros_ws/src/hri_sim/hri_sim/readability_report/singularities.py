"""Ways of the tool through postures in which it cannot move in some direction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_planner.robot.model import RobotModel, load_robot
from hri_prediction.geometry.minimum_jerk import minimum_jerk

FloatArray = NDArray[np.float64]

COUNT, SMOKE_COUNT = 30, 2
"""Ways of each kind."""
KINDS = {
    "stretched": "elbow and wrist straight: the tool is as far from the shoulder as it can be",
    "inner": "upper arm straight up, the elbow turned aside by 90°, wrist straight",
}
SECONDS = 2.5
TRAVEL_RAD = 0.8
"""Of all joints together, half of it before the singular posture."""
_REST_S = 0.4
_DT = 0.004
_STREAM = 73


def singularities(smoke: bool) -> dict[str, Any]:
    """Largest joint speeds [rad/s] and errors of the tool [mm] on ways of each kind.

    Each way is the tool's in a smooth motion of the joints through the posture: it can be gone exactly, by
    joints that are slow. The inverse kinematics is given the tool's way alone.
    """
    robot, rng = load_robot(), np.random.default_rng(_STREAM)
    found = {}
    for kind in KINDS:
        pairs = np.array(
            [
                _follow(robot, _posture(kind, rng), _direction(rng))
                for _ in range(SMOKE_COUNT if smoke else COUNT)
            ]
        )
        errors, speeds = pairs.T
        found[kind] = {
            "count": len(pairs),
            "error_median_mm": float(np.median(errors)),
            "error_max_mm": float(errors.max()),
            "error_below_1mm_share": float(np.mean(errors <= 1.0)),
            "speed_median_rad_s": float(np.median(speeds)),
            "speed_max_rad_s": float(speeds.max()),
        }
    return found


def _posture(kind: str, rng: np.random.Generator) -> FloatArray:
    turned, first, fifth = rng.uniform(-1.0, 1.0, 3)
    if kind == "stretched":
        return np.array((first, rng.uniform(-1.2, 1.2), turned, 0.0, fifth, 0.0, 0.0))
    aside = 0.5 * np.pi * rng.choice((-1.0, 1.0))
    return np.array((first, 0.0, aside, rng.uniform(0.6, 1.9), fifth, 0.0, 0.0))


def _direction(rng: np.random.Generator) -> FloatArray:
    drawn = rng.standard_normal(7)
    return np.asarray(TRAVEL_RAD * drawn / np.linalg.norm(drawn))


def _follow(robot: RobotModel, through: FloatArray, travel: FloatArray) -> tuple[float, float]:
    """Largest error of the tool [mm] and largest joint speed [rad/s]."""
    steps = round((SECONDS + _REST_S) / _DT)
    share = minimum_jerk(np.arange(steps + 1) * _DT / SECONDS)
    whole = through + (share[:, None] - 0.5) * travel
    way = robot.frames(whole)[:, 3]
    velocities = np.gradient(way, _DT, axis=0)
    inverse = ToolVelocity(robot, PolicyConfig().inverse_kinematics)
    q, speeds, worst, fastest = whole[0], np.zeros(7), 0.0, 0.0
    for step in range(steps):
        speeds = inverse.joint_speeds(q, speeds, way[step], velocities[step], _DT)
        q = q + speeds * _DT
        fastest = max(fastest, float(np.abs(speeds).max()))
        worst = max(worst, float(np.linalg.norm(inverse.tool(q) - way[step + 1])))
    return 1e3 * worst, fastest


def lines(found: Mapping[str, Any]) -> list[list[str]]:
    """Rows of a table: kind, ways, errors, speeds."""
    return [
        [
            KINDS[kind],
            str(one["count"]),
            f"{one['error_median_mm']:.2f}",
            f"{one['error_max_mm']:.2f}",
            f"{100.0 * one['error_below_1mm_share']:.0f}",
            f"{one['speed_max_rad_s']:.2f}",
        ]
        for kind, one in found.items()
    ]
