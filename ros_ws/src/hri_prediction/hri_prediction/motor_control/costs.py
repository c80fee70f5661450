"""The seven basic costs of reaching, and weights of them (thesis table 2.1, eqs. 2.16 and 2.17)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import ConfigError, DataError

Array = NDArray[np.float64]

HAND_JERK, ACCELERATION, JOINT_JERK = "hand_jerk", "joint_acceleration", "joint_jerk"
TORQUE_CHANGE, TORQUE, ENERGY, GEODESIC = "torque_change", "torque", "energy", "geodesic"
COSTS = (HAND_JERK, ACCELERATION, JOINT_JERK, TORQUE_CHANGE, TORQUE, ENERGY, GEODESIC)
"""In the order of every array of all costs (7,). Each is an integral over the time of the reach of:
squared jerk of the hand [m^2/s^6], squared joint accelerations, squared joint jerks, squared rates of the
torques, squared torques, absolute power of the joints [W], root of q'^T M q'."""
CHAPTER_2 = (HAND_JERK, JOINT_JERK, TORQUE_CHANGE, ENERGY)
"""The four that chapter 2 of the thesis reports."""
CHAPTER_3 = (HAND_JERK, JOINT_JERK, TORQUE_CHANGE, GEODESIC, ENERGY)
"""The five of chapter 3 (eq. 2.16)."""
KINEMATIC, DYNAMIC = (HAND_JERK, JOINT_JERK), (TORQUE_CHANGE, ENERGY)
"""What the thesis groups contributions into; geodesic is of neither."""
ABBREVIATIONS = {
    HAND_JERK: "HJ", ACCELERATION: "JA", JOINT_JERK: "JJ", TORQUE_CHANGE: "TC", TORQUE: "Tor",
    ENERGY: "Enr", GEODESIC: "Geo",
}  # fmt: skip


@dataclass(frozen=True)
class Smoothing:
    """What makes |.| and the root differentiable: sqrt(x^2 + e^2) - e.

    Attributes:
        power: e of the power of a joint [W]. Ten times coarser moves the hand by 3 mm, finer by 0.3 mm.
        speed: e of the root of q'^T M q' [kg^(1/2) m/s].

    Raises:
        ConfigError: one is not finite and positive.
    """

    power: float = 0.05
    speed: float = 0.02

    def __post_init__(self) -> None:
        for name in ("power", "speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError(f"Smoothing.{name} = {value!r}", expected="a positive number")


SMOOTHING = Smoothing()


def indices_of(names: Sequence[str]) -> NDArray[np.int64]:
    """Where costs stand among all seven.

    Raises:
        ConfigError: on a name that is none, named twice, or an empty list.
    """
    unknown = [name for name in names if name not in COSTS]
    if unknown or not names or len(set(names)) < len(names):
        raise ConfigError(
            f"costs {', '.join(map(str, names)) or 'none'}",
            expected="one or more of " + ", ".join(COSTS) + ", each once",
        )
    return np.array([COSTS.index(name) for name in names])


def check_simplex(alpha: ArrayLike, names: Sequence[str]) -> Array:
    """Weights alpha of some costs as an array (n,).

    Raises:
        DataError: when they are not as many as the costs, negative, not finite, or do not sum to 1.
    """
    weights = np.array(alpha, dtype=float)
    if weights.shape != (len(names),):
        raise DataError(
            f"alpha has shape {weights.shape}", expected=f"({len(names)},): {', '.join(names)}"
        )
    if not np.isfinite(weights).all() or (weights < 0.0).any() or abs(weights.sum() - 1.0) > 1e-6:
        raise DataError(
            f"alpha = {np.array2string(weights, precision=6)}",
            expected="weights of 0 or more that sum to 1",
        )
    return weights


def check_weights(weights: ArrayLike) -> Array:
    """Weights of all seven costs as an array (7,).

    Raises:
        DataError: when they are not as many, negative, not finite, or all 0.
    """
    chosen = np.array(weights, dtype=float)
    if chosen.shape != (len(COSTS),):
        raise DataError(f"weights have shape {chosen.shape}", expected=f"({len(COSTS)},)")
    if not np.isfinite(chosen).all() or (chosen < 0.0).any() or not chosen.any():
        raise DataError(
            f"weights {chosen.tolist()}", expected="finite, 0 or more, at least one more than 0"
        )
    return chosen


def shares(alpha: ArrayLike, names: Sequence[str], group: Sequence[str]) -> Array:
    """Summed weights of a group of costs: alpha (..., n) -> (...)."""
    chosen = [index for index, name in enumerate(names) if name in group]
    found: Array = np.asarray(alpha)[..., chosen].sum(axis=-1)
    return found
