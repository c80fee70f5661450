"""Where trunk and head are, of somebody of whom the shoulders are seen and nothing else.

Nobody sees how far a trunk leans: its hips may be anywhere between a little before the shoulders and
far behind them, and the head as far before them, so there are several axes in a fan. Shoulders that are
not level may be those of somebody who leans aside, or just shrugs: the fan is as wide as both need.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.config import BodyConfig
from hri_prediction.arm.geometry import SIDES

FloatArray = NDArray[np.float64]

FAN = 4
"""So many axes stand for all leans: at the hips, with usual sizes, 13 cm apart, less than a radius."""
BACKWARDS = 1.0 / 3.0
"""How far people lean back, as a share of how far they lean forwards."""
LEAST_BREADTH_M = 0.05
"""Shoulders that are closer together, seen from above, do not tell which way somebody faces."""
_NAMES = ("left side", "trunk", "right side")
_SIGNS = np.array([-1.0, 0.0, 1.0])
_UP = np.array([0.0, 0.0, 1.0])


class Capsule(NamedTuple):
    """A part of trunk or head: its name, the ends of its axis (2, 3) [m], its radius [m]."""

    name: str
    ends: FloatArray
    radius: float


def trunk_and_head(shoulders: Mapping[str, FloatArray], config: BodyConfig) -> list[Capsule]:
    """Capsules of trunk and head.

    Args:
        shoulders: The shoulders (3,) [m] that are seen, by side.
        config: Sizes.
    """
    found = [shoulders[side] for side in SIDES if side in shoulders]
    if not found:
        return []
    middle = np.mean(found, axis=0)
    half = 0.5 * config.shoulder_breadth
    if len(found) == 2:
        across = 0.5 * (found[1] - found[0])
        if math.hypot(across[0], across[1]) >= 0.5 * LEAST_BREADTH_M:
            return _fan(middle, across, config)
        half = math.hypot(*across)
    # Either end of the shoulders, and a lean in any direction square to them.
    parts = (
        ("trunk", -config.trunk_length, config.trunk_radius),
        ("head", config.head_height, config.head_radius),
    )
    return [
        Capsule(
            name,
            np.stack((middle, middle + up * _UP)),
            radius + math.hypot(half, up * math.sin(config.max_lean)),
        )
        for name, up, radius in parts
    ]


def _fan(middle: FloatArray, across: FloatArray, config: BodyConfig) -> list[Capsule]:
    """Axes below both ends and the middle of the chest, and above it, for each lean.

    Args:
        middle: Between the shoulders (3,) [m].
        across: From there to the right shoulder (3,) [m].
        config: Sizes.
    """
    half = math.hypot(*across)
    right = across / half
    forwards = np.array([-right[1], right[0], 0.0])  # up x right
    forwards /= math.hypot(*forwards)
    # Straight down, if the shoulders are shrugged; square to them, if the trunk leans aside.
    square = right * right[2] - _UP
    square /= math.hypot(*square)
    # The hips are below the higher shoulder, or beyond it.
    shares = 0.5 * (1.0 + _SIGNS * np.sign(right[2]))[:, None]
    downs = shares * square - (1.0 - shares) * _UP
    downs /= np.sqrt((downs**2).sum(axis=1, keepdims=True))
    # The trunk is broader than deep: its sides stand as far out as the chest is broad.
    inner = max(1.0 - config.trunk_radius / half, 0.0)
    tops = middle + inner * _SIGNS[:, None] * across
    leans = np.linspace(-BACKWARDS * config.max_lean, config.max_lean, FAN)[:, None, None]
    hips = tops + config.trunk_length * (np.cos(leans) * downs - np.sin(leans) * forwards)
    trunk = np.empty((FAN, len(tops), 2, 3))
    trunk[:, :, 0], trunk[:, :, 1] = tops, hips
    found = [
        Capsule(name, ends, config.trunk_radius)
        for fan in trunk
        for name, ends in zip(_NAMES, fan, strict=True)
    ]
    # A head behind the shoulders is nearer to the trunk: two axes will do.
    for lean in (0.0, config.max_lean):
        way = math.cos(lean) * _UP + math.sin(lean) * forwards
        ends = np.array((middle, middle + config.head_height * way))
        found.append(Capsule("head", ends, config.head_radius))
    return found
