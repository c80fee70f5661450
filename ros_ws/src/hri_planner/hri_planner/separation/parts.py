"""What a person is made of: the limbs that are tracked, and trunk and head where shoulders have them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.config import BodyConfig
from hri_planner.separation.trunk import trunk_and_head

FloatArray = NDArray[np.float64]

WAS = " (as it was)"
LIMBS = ("upper_arm", "forearm", "hand")
SHOULDER = 0
SAME_M = 0.1
"""A shoulder that is no farther from where it was has not jumped [m]."""


@dataclass(frozen=True, eq=False)
class SeenArm:
    """One arm of a person, as it was seen.

    Attributes:
        side: ``"left"`` or ``"right"``.
        keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m], each where it was seen last.
        age_s: How long ago that was (4,) [s].
        speeds: Measured velocities (4, 3) [m/s]; NaN where too little was seen to tell.
        spreads: Standard deviations of these (4,) per metre of noise in the samples [1/s].
        half_window_s: How much older than the places the velocities are [s].
        was: Whether the arm is no longer there as far as is seen, and only doubted to have gone.
    """

    side: str
    keypoints: FloatArray
    age_s: FloatArray
    speeds: FloatArray
    spreads: FloatArray
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
        spreads: Of these (2,) [1/s], see :class:`SeenArm`.
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
    spreads: FloatArray
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
                    f"{arm.side} {name}" + (WAS if arm.was else ""),
                    arm.keypoints[ends],
                    radii[limb],
                    arm.age_s[ends],
                    arm.speeds[ends],
                    arm.spreads[ends],
                    arm.half_window_s,
                    arm=True,
                    side="" if arm.was else arm.side,
                    limb=limb,
                )
            )
    if config.trunk:
        seen = {arm.side: arm for arm in arms if not arm.was}
        parts += _trunk(body_id, seen, config)
        for group in _shoulders_that_were(arms, seen):
            parts += _trunk(body_id, group, config, was=True)
    return parts


def _shoulders_that_were(
    arms: Sequence[SeenArm], seen: Mapping[str, SeenArm]
) -> list[dict[str, SeenArm]]:
    """Arms that a trunk hangs from where nobody is seen any longer: one or both of a trunk.

    Of an arm whose shoulder is where it was, only the rest has jumped: its trunk is there already.
    """
    gone = [
        arm
        for arm in arms
        if arm.was
        and not (
            arm.side in seen
            and math.dist(arm.keypoints[SHOULDER], seen[arm.side].keypoints[SHOULDER]) < SAME_M
        )
    ]
    together = {arm.side: arm for arm in gone}
    if not seen and len(together) == len(gone):
        return [together] if gone else []
    return [{arm.side: arm} for arm in gone]


def _trunk(
    body_id: str, arms: Mapping[str, SeenArm], config: BodyConfig, *, was: bool = False
) -> list[Part]:
    """Trunk and head of somebody whose arms these are."""
    shoulders = {side: arm.keypoints[SHOULDER] for side, arm in arms.items()}
    ages = np.full(2, max((arm.age_s[SHOULDER] for arm in arms.values()), default=0.0))
    # Nobody measures head and hips: they may be as fast as is assumed.
    unknown = np.full((2, 3), np.nan)
    return [
        Part(
            body_id,
            capsule.name + (WAS if was else ""),
            capsule.ends,
            capsule.radius,
            ages,
            unknown,
            unknown[:, 0],
            0.0,
            arm=False,
        )
        for capsule in trunk_and_head(shoulders, config)
    ]
