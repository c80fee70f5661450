"""What a person is made of: the limbs that are tracked, and trunk and head where shoulders have them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.config import BodyConfig
from hri_prediction.arm.geometry import SIDES

FloatArray = NDArray[np.float64]

LIMBS = ("upper_arm", "forearm", "hand")
SHOULDER = 0
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class SeenArm:
    """One arm of a person, as it was seen.

    Attributes:
        side: ``"left"`` or ``"right"``.
        keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m], each where it was seen last.
        age_s: How long ago that was (4,) [s].
        speeds: Measured velocities (4, 3) [m/s]; NaN where too little was seen to tell.
        half_window_s: How much older than the places the velocities are [s].
        was: Whether the arm is no longer there as far as is seen, and only doubted to have gone.
    """

    side: str
    keypoints: FloatArray
    age_s: FloatArray
    speeds: FloatArray
    half_window_s: float
    was: bool = False

    def doubted(self) -> SeenArm:
        """The same where nobody knows whether it is still there, nor how fast."""
        return replace(self, speeds=np.full((4, 3), np.nan), was=True)


@dataclass(frozen=True, eq=False)
class Part:
    """One capsule of a person.

    Attributes:
        body_id: Whose.
        name: Which: a limb with its side, ``trunk`` or ``head``.
        ends: Of its axis (2, 3) [m].
        radius: [m].
        age_s: Of the samples behind the ends (2,) [s].
        speeds: Of the ends (2, 3) [m/s].
        half_window_s: See :class:`SeenArm`.
        arm: Whether it is of an arm, and as fast as one.
        side: Of an arm that is seen where it is; empty: nothing is predicted for the part.
        limb: Index in :data:`LIMBS`, for arms.
    """

    body_id: str
    name: str
    ends: FloatArray
    radius: float
    age_s: FloatArray
    speeds: FloatArray
    half_window_s: float
    arm: bool
    side: str = ""
    limb: int = 0


def parts_of(body_id: str, arms: Sequence[SeenArm], config: BodyConfig) -> list[Part]:
    """The capsules of a person."""
    radii = (config.radius_upper_arm, config.radius_forearm, config.radius_hand)
    parts = []
    for arm in arms:
        for limb, name in enumerate(LIMBS):
            ends = slice(limb, limb + 2)
            parts.append(
                Part(
                    body_id,
                    f"{arm.side} {name}" + (" (as it was)" if arm.was else ""),
                    arm.keypoints[ends],
                    radii[limb],
                    arm.age_s[ends],
                    arm.speeds[ends],
                    arm.half_window_s,
                    arm=True,
                    side="" if arm.was else arm.side,
                    limb=limb,
                )
            )
    if config.trunk:
        parts += _trunk(body_id, {arm.side: arm for arm in arms if not arm.was}, config)
    return parts


def _trunk(body_id: str, arms: Mapping[str, SeenArm], config: BodyConfig) -> list[Part]:
    """Trunk and head below and above the shoulders; a shoulder seen alone may be either one's end."""
    found = [arms[side] for side in SIDES if side in arms]
    if not found:
        return []
    first, last = found[0].keypoints[SHOULDER], found[-1].keypoints[SHOULDER]
    ages = np.full(2, max(arm.age_s[SHOULDER] for arm in found))
    # Nobody measures head and hips: they may be as fast as is assumed.
    speeds, window = np.full((2, 3), np.nan), 0.0
    half = 0.5 * config.shoulder_breadth
    if len(found) == 1:
        middle, wider = first, half
    else:
        middle, wider = 0.5 * (first + last), 0.0
    hips = middle - config.trunk_length * _UP
    head = middle + config.head_height * _UP
    radius = config.trunk_radius + wider
    trunk = Part(
        body_id, "trunk", np.array((middle, hips)), radius, ages, speeds, window, arm=False
    )
    parts = [
        trunk,
        Part(
            body_id,
            "head",
            np.array((middle, head)),
            config.head_radius + wider,
            ages,
            speeds,
            window,
            arm=False,
        ),
    ]
    if len(found) == 2:
        # The trunk is broader than deep: two more axes stand below the ends of the chest.
        across = 0.5 * (last - first)
        inner = max(1.0 - config.trunk_radius / max(math.hypot(*across), 1e-6), 0.0)
        for name, sign in (("left side", -1.0), ("right side", 1.0)):
            top = middle + sign * inner * across
            ends = np.array((top, top - config.trunk_length * _UP))
            parts.append(
                Part(body_id, name, ends, config.trunk_radius, ages, speeds, window, arm=False)
            )
    return parts
