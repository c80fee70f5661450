"""All pairs of a part of the robot and one of a person: which of them allows least."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.kinematics import arm_points, point_jacobian
from hri_planner.separation.travel import (
    FIXED,
    REACTION,
    SETTLING,
    STOPPING,
    TERMS,
    allowed_scale,
    harmless_scale,
    human_travel,
    robot_travel,
)
from hri_prediction.compiled import njit
from hri_prediction.geometry.segments import closest_parameters

FloatArray = NDArray[np.float64]
LINKS = 3

# Places in a row of results, after the terms.
DISTANCE, PROTECTIVE, SCALE, RAISED, LINK, PART = range(TERMS, TERMS + 6)
ROW = TERMS + 6


class PartArrays(NamedTuple):
    """Arguments of :func:`least_allowed` that are of people, m parts and k predicted instants."""

    ends: FloatArray
    radii: FloatArray
    ages: FloatArray
    speeds: FloatArray
    spreads: FloatArray
    half_windows: FloatArray
    fastest: FloatArray
    modes: NDArray[np.int64]
    times: FloatArray
    means: FloatArray
    covariances: FloatArray
    aheads: FloatArray

    @classmethod
    def empty(cls, m: int, k: int) -> PartArrays:
        """Arrays to be filled; of nobody predicted."""
        return cls(
            np.empty((m, 2, 3)),
            np.empty(m),
            np.empty((m, 2)),
            np.empty((m, 2, 3)),
            np.empty((m, 2)),
            np.empty(m),
            np.empty(m),
            np.zeros(m, dtype=np.int64),
            np.full((m, k), -np.inf),
            np.zeros((m, 2, k, 3)),
            np.zeros((m, 2, k, 3, 3)),
            np.zeros((m, 2)),
        )


@njit
def robot_ends(q: Any, qd: Any, lengths: Any, ends: Any, speeds: Any) -> None:
    """Shoulder, elbow, wrist and tool, and how fast they are.

    Args:
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
        lengths: Of the robot (4,) [m].
        ends: Result (4, 3) [m].
        speeds: Result (4, 3) [m/s].
    """
    arm_points(q, lengths, ends)
    point, jacobian = np.empty(3), np.empty((3, 7))
    speeds[0] = 0.0
    for link in range(LINKS):
        point_jacobian(q, lengths, link, 1.0, point, jacobian)
        for k in range(3):
            total = 0.0
            for joint in range(7):
                total += jacobian[k, joint] * qd[joint]
            speeds[link + 1, k] = total


@njit
def fastest_of(velocities: Any) -> float:
    """Speed of the fastest of some points (k, 3) [m/s]; NaN where one of them is not known."""
    fastest = 0.0
    for point in range(len(velocities)):
        squares = 0.0
        for k in range(3):
            squares += velocities[point, k] ** 2
        if not squares <= fastest and not math.isnan(fastest):  # NaN stays
            fastest = squares
    return math.sqrt(fastest)


@njit
def least_allowed(
    robot: Any,
    moving: Any,
    robot_radii: Any,
    rate: float,
    slowest: float,
    path_speed: float,
    ends: Any,
    radii: Any,
    ages: Any,
    speeds: Any,
    spreads: Any,
    half_windows: Any,
    fastest: Any,
    modes: Any,
    times: Any,
    means: Any,
    covariances: Any,
    aheads: Any,
    margin: float,
    par: Any,
    out: Any,
) -> None:
    """The pair that allows least.

    Args:
        robot: Shoulder, elbow, wrist and tool (4, 3) [m].
        moving: Their velocities (4, 3) [m/s].
        robot_radii: Of the robot's parts (3,) [m].
        rate: Rate at which the robot follows its path, 0...1.
        slowest: The least rate behind the velocities, with which the arm follows late.
        path_speed: Of the fastest point of the path now, at full rate [m/s]; below 0: not known.
        ends: Of the parts of people (m, 2, 3) [m].
        radii: Of these (m,) [m].
        ages: Of the ends' samples (m, 2) [s].
        speeds: Of the ends (m, 2, 3) [m/s].
        spreads: Standard deviations of these per metre of noise in the samples (m, 2) [1/s].
        half_windows: How much older than places velocities are (m,) [s].
        fastest: Assumed speeds (m,) [m/s].
        modes: What is reckoned with for each part (m,).
        times: Of predicted instants (m, k) [s].
        means: Predicted places (m, 2, k, 3) [m].
        covariances: Of these (m, 2, k, 3, 3) [m²].
        aheads: How much older than ends the predictions' samples are (m, 2) [s].
        margin: Room on top, without which the robot does not become faster [m].
        par: Parameters, see :mod:`travel`.
        out: Result (ROW,): terms at the present rate, distance, protective distance, allowed scale, the
            scale that is allowed with the margin, and the parts. Of no pair PART is -1.
    """
    row = np.empty(TERMS)
    outward = np.empty(3)
    out[PART] = -1.0
    least, raised, worst = 1.0, 1.0, np.inf
    keep, kept = (np.inf, 0.0, 0.0, -1.0), row.copy()
    known = True
    for part in range(len(ends)):
        for link in range(LINKS):
            s, t, squares = closest_parameters(
                robot[link], robot[link + 1], ends[part, 0], ends[part, 1]
            )
            between = math.sqrt(squares)
            distance = between - robot_radii[link] - radii[part]
            if between > 1e-9:
                toward = -np.inf
                for k in range(3):
                    place = robot[link, k] + s * (robot[link + 1, k] - robot[link, k])
                    theirs = ends[part, 0, k] + t * (ends[part, 1, k] - ends[part, 0, k])
                    outward[k] = (place - theirs) / between
                for end in range(2):
                    directed = 0.0
                    for k in range(3):
                        directed -= moving[link + end, k] * outward[k]
                    if not directed <= toward and not math.isnan(toward):  # NaN stays
                        toward = directed
            else:  # no direction: whatever moves comes nearer
                outward[:] = 0.0
                toward = 0.0
            seconds = par[REACTION] + par[STOPPING] * rate + par[SETTLING]
            protective = (
                robot_travel(toward, slowest, path_speed, rate, par, row)
                + human_travel(
                    seconds, ends[part], ages[part], speeds[part], spreads[part], half_windows[part],
                    fastest[part], modes[part], outward, times[part], means[part], covariances[part],
                    aheads[part], par, row,
                )
                + par[FIXED]
            )  # fmt: skip
            allowed = allowed_scale(
                distance, toward, slowest, path_speed, ends[part], ages[part], speeds[part],
                spreads[part], half_windows[part], fastest[part], modes[part], outward, times[part],
                means[part], covariances[part], aheads[part], par, out,
            )  # fmt: skip
            up = allowed
            if margin > 0.0:
                up = allowed_scale(
                    distance - margin, toward, slowest, path_speed, ends[part], ages[part],
                    speeds[part], spreads[part], half_windows[part], fastest[part], modes[part],
                    outward, times[part], means[part], covariances[part], aheads[part], par, out,
                )  # fmt: skip
            raised = min(raised, up)
            known = known and not math.isnan(distance - protective) and not math.isnan(toward)
            if allowed < least or (allowed == least and distance - protective < worst):
                least, worst = allowed, distance - protective
                keep = (distance, protective, float(link), float(part))
                kept = row.copy()
    if worst < np.inf:
        out[:TERMS] = kept
        out[DISTANCE], out[PROTECTIVE], out[LINK], out[PART] = keep
    # What is not known is not harmless either.
    harmless = harmless_scale(fastest_of(moving), slowest, path_speed, par) if known else 0.0
    out[SCALE], out[RAISED] = max(least, harmless), max(raised, harmless)
