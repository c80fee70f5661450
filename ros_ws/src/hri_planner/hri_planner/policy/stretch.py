"""Control steps of hand and arm, in one compiled piece.

What is wanted is an acceleration that is held, as networks say it, or what a movement primitive says at
each step (:mod:`hri_planner.dmp.drive`).

Each step is filtered (:mod:`hri_planner.policy.separation`), integrated as by
:class:`hri_planner.policy.runner.PolicyRunner`, and followed by the joints
(:mod:`hri_planner.policy.tool_velocity`). Compiled code leaves the interpreter to the node's callbacks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.drive import MEMORY, NO_DRIVE, Drive, drive_acceleration
from hri_planner.policy.limbs import places_of
from hri_planner.policy.link_bounds import LINKS, link_bounds
from hri_planner.policy.links import ARM_LINKS, away_from_limbs
from hri_planner.policy.partner import Partner
from hri_planner.policy.separation import NO_BOXES, SeparationConfig, kept_apart
from hri_planner.policy.tool_velocity import ToolVelocity, joint_speeds
from hri_planner.robot.kinematics import tool_jacobian
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

STRAYED_M = 0.005
"""A hand that the joints cannot follow within this is put back to where the tool is [m]."""
_DEEP_M = 5.0


@dataclass(frozen=True, eq=False)
class Moved:
    """After each of n steps.

    Attributes:
        position: Of the hand (n, 3) [m].
        velocity: Of the hand (n, 3) [m/s].
        acceleration: Held until then (n, 3) [m/s²].
        filtered: Whether a filter had changed it (n,).
        strayed: Whether the joints could not follow (n,).
        q: Joint angles (n, 7) [rad].
        qd: Joint speeds (n, 7) [rad/s].
        memory: What a movement primitive remembers (n, 4).
        nearest: Smallest distance from the axes of partners' limbs before a step [m]; infinite without
            partners.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    filtered: BoolArray
    strayed: BoolArray
    q: FloatArray
    qd: FloatArray
    memory: FloatArray
    nearest: float


@dataclass(frozen=True, eq=False)
class Limits:
    """What a hand keeps to.

    Attributes:
        separation: Parameters of the filter.
        apart: Whether people are kept clear of; the largest acceleration holds anyhow.
        floor: Height that the hand stays above [m]; none: any.
        boxes: Centre and half the size of boxes that it stays out of, edges along the axes
            (k, 2, 3) [m].
        margin: Distance of the tool's axis from the boxes that is kept [m]; the robot's links keep
            as much between the surfaces.
        limb_radii: Of people's limbs, from the shoulder on [m].
        tool_radius: Of what is around the tool [m].
        link_radii: Of upper and lower arm of the robot [m].
        link_reach: Distance of people within which the robot's arm gives way to them, so far as the
            tool's motion lets it [m]; 0: never.
        link_gain: Share of what is missing to it that is made up a second [1/s].
    """

    separation: SeparationConfig
    apart: bool
    floor: float | None
    boxes: FloatArray = field(default_factory=lambda: NO_BOXES)
    margin: float = 0.0
    limb_radii: tuple[float, ...] = (0.05, 0.04, 0.05)
    tool_radius: float = 0.06
    link_radii: tuple[float, ...] = (0.07, 0.07)
    link_reach: float = 0.0
    link_gain: float = 4.0

    @property
    def link_boxes(self) -> FloatArray:
        """What all links stay out of (k, 2, 3) [m]: boxes, and all that is below the floor."""
        if self.floor is None:
            return self.boxes
        # The hand's axis may come down to the floor, as the tool may.
        top = self.floor - self.margin
        below = np.array(((0.0, 0.0, top - _DEEP_M), (_DEEP_M, _DEEP_M, _DEEP_M)))
        return np.concatenate((self.boxes, below[None]))


def stretch(
    position: FloatArray,
    velocity: FloatArray,
    wanted: FloatArray | Drive,
    q: FloatArray,
    qd: FloatArray,
    partners: Sequence[Partner],
    steps: int,
    dt: float,
    limits: Limits,
    inverse: ToolVelocity,
    memory: FloatArray | None = None,
) -> Moved:
    """Some control steps on.

    Args:
        position: Of the hand (3,) [m], base frame.
        velocity: Of the hand (3,) [m/s].
        wanted: Acceleration that is held (3,) [m/s²], or a movement primitive.
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
        partners: What is known of others at the first step.
        steps: How many.
        dt: Control period [s].
        limits: What is kept to.
        inverse: Joint speeds of the robot.
        memory: What the movement primitive remembers (4,).
    """
    driven = wanted.constants(dt) if isinstance(wanted, Drive) else NO_DRIVE
    held = np.zeros(3) if isinstance(wanted, Drive) else wanted
    remembered = np.zeros(MEMORY) if memory is None else memory
    joints, speeds, ages = _stacked(partners)
    config = limits.separation
    found = Moved(
        np.empty((steps, 3)),
        np.empty((steps, 3)),
        np.empty((steps, 3)),
        np.zeros(steps, dtype=np.bool_),
        np.zeros(steps, dtype=np.bool_),
        np.empty((steps, 7)),
        np.empty((steps, 7)),
        np.empty((steps, MEMORY)),
        np.inf,
    )
    limbs = np.array(limits.limb_radii)
    nearest = _stretch(
        (position, velocity, held, q, qd, remembered),
        driven,
        joints,
        speeds,
        ages,
        dt,
        limits.apart,
        (
            config.separation,
            config.hand_acceleration,
            config.partner_acceleration,
            config.approach,
            -math.inf if limits.floor is None else limits.floor,
            limits.boxes,
            limits.margin,
        ),
        (
            limbs + limits.tool_radius,
            limits.tool_radius,
            np.array(limits.link_radii[:ARM_LINKS])[:, None] + limbs,
            limits.link_reach,
            limits.link_gain,
            limits.margin - limits.tool_radius + np.array((*limits.link_radii, limits.tool_radius)),
            limits.link_boxes,
        ),
        inverse.constants,
        (found.position, found.velocity, found.acceleration, found.q, found.qd, found.memory),
        found.filtered,
        found.strayed,
    )
    return replace(found, nearest=nearest)


def _stacked(partners: Sequence[Partner]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Joints (p, n, 3), their velocities (p, n, 3) and ages (p,); shorter arms end in several hands."""
    most = max((1 if p.joints is None else len(p.joints) for p in partners), default=1)
    joints, speeds = np.empty((len(partners), most, 3)), np.empty((len(partners), most, 3))
    for index, partner in enumerate(partners):
        joints[index], speeds[index] = partner.position, partner.velocity
        if partner.joints is not None and partner.speeds is not None:
            joints[index, : len(partner.joints)] = partner.joints
            speeds[index, : len(partner.joints)] = partner.speeds
    return joints, speeds, np.array([partner.age for partner in partners])


@njit
def _stretch(
    state: Any,
    drive: Any,
    joints: Any,
    speeds: Any,
    ages: Any,
    dt: float,
    apart: bool,
    limits: Any,
    surfaces: Any,
    inverse: Any,
    found: Any,
    filtered: Any,
    strayed: Any,
) -> float:
    """Fill what is found; the smallest distance from partners."""
    people, count = joints.shape[0], 2 * joints.shape[1] - 1
    places, moving = np.empty((people * count, 3)), np.empty((people * count, 3))
    old = np.empty(people * count)
    tool, jacobian = np.empty(3), np.empty((3, 7))
    lengths, lower, upper = inverse[0], inverse[1], inverse[2]
    position, velocity, wanted = state[0].copy(), state[1].copy(), state[2].copy()
    q, qd, memory = state[3].copy(), state[4].copy(), state[5].copy()
    boxes, margin = limits[5], surfaces[1]
    axes, ends, radii = _capsules(joints, speeds, surfaces[0])
    now, begun, row, away = joints.copy(), axes.copy(), np.zeros(7), 0.0
    solids = surfaces[6]
    links_outward, links_least = np.zeros((LINKS * len(solids), 3)), np.zeros(LINKS * len(solids))
    nearest = np.inf
    kept = people * count if apart else 0
    for step in range(len(filtered)):
        for person in range(people):
            own = slice(person * count, (person + 1) * count)
            now[person] = joints[person] + step * dt * speeds[person]
            places[own], moving[own] = places_of(now[person], speeds[person], position)
            old[own] = max(ages[person] + step * dt, 0.0)
        for index in range(people * count):
            nearest = min(nearest, math.sqrt(np.sum((places[index] - position) ** 2)))
        if drive[0]:
            axes[:] = begun + step * dt * ends
            drive_acceleration(
                position, velocity, memory, drive, axes, ends, radii, boxes, margin, wanted
            )
        link_bounds(
            q,
            qd,
            lengths,
            solids,
            surfaces[5],
            dt,
            limits[1],
            limits[3],
            links_outward,
            links_least,
        )
        acceleration, filtered[step] = kept_apart(
            wanted, position, velocity, places[:kept], moving[:kept], old[:kept], dt,
            limits[0], limits[1], limits[2], limits[3], limits[4], boxes, limits[6],
            links_outward, links_least,
        )  # fmt: skip
        position = position + velocity * dt + acceleration * (0.5 * dt * dt)
        velocity = velocity + acceleration * dt
        if surfaces[3] > 0.0:
            away = away_from_limbs(
                q, lengths, now, speeds, surfaces[2], surfaces[3], surfaces[4], row
            )
        new = joint_speeds(q + qd * dt, qd, position, velocity, dt, row, away, *inverse)
        q = np.minimum(np.maximum(q + 0.5 * dt * (qd + new), lower), upper)
        qd = new
        tool_jacobian(q, lengths, tool, jacobian)
        if math.sqrt(np.sum((tool - position) ** 2)) > STRAYED_M:
            strayed[step] = True
            position, velocity = tool.copy(), jacobian @ qd
        found[0][step], found[1][step], found[2][step] = position, velocity, acceleration
        found[3][step], found[4][step], found[5][step] = q, qd, memory
    return nearest


@njit
def _capsules(joints: Any, speeds: Any, radii: Any) -> Any:
    """Axes (m, 2, 3), speeds of their ends (m, 2, 3) and radii (m,) of all limbs; a lone hand is one."""
    people, count = joints.shape[0], joints.shape[1]
    limbs = max(count - 1, 1)
    axes, ends = np.empty((people * limbs, 2, 3)), np.empty((people * limbs, 2, 3))
    wide = np.empty(people * limbs)
    for person in range(people):
        for limb in range(limbs):
            index, last = person * limbs + limb, min(limb + 1, count - 1)
            axes[index, 0], axes[index, 1] = joints[person, limb], joints[person, last]
            ends[index, 0], ends[index, 1] = speeds[person, limb], speeds[person, last]
            # Counted from the hand: what is known of an arm may begin at the elbow.
            wide[index] = radii[max(len(radii) - limbs + limb, 0)]
    return axes, ends, wide
