"""A filter on accelerations that keeps the hand a set distance from the partner's.

Learnt behaviour carries no guarantee. With x = s - p the partner-to-hand vector, n = x / |x| and the
closing speed c = -n·(v - w), the separation D can be kept as long as

    h = n·x - D - max(c, 0)² / (2 (a_hand - a_partner)) >= 0:

a hand that may accelerate by a_hand along n then stops closing in before D, whatever a partner does
whose acceleration is at most a_partner. This is a discrete barrier: of all accelerations after which
h >= 0 one step later, for the worst that the partner may do meanwhile, the one nearest to the wanted
is taken. As |x| is at least its projection on any fixed direction, what is shown along n holds for
the distance.

What was seen of the partner some time ago bounds where it is now: within a_partner t² / 2 of where it
would be by its velocity then, which differs by at most a_partner t.

Nothing can be promised when the partner is nearer than that to begin with, is faster than the hand
and chases it, or when the hand has nowhere to go; then the hand flees as fast as it may.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SeparationConfig:
    """Parameters of the filter.

    Raises:
        ConfigError: when a value is out of range, or the partner's acceleration is not the smaller.
    """

    separation: float = parameter(
        0.10, "distance of the tool from the partner's hand that is kept", unit="m", low=0.0
    )
    hand_acceleration: float = parameter(
        8.0, "largest acceleration of the tool", unit="m/s^2", low=0.1
    )
    partner_acceleration: float = parameter(
        4.0, "acceleration that the partner's hand is taken to be capable of", unit="m/s^2", low=0.0
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)
        if self.partner_acceleration >= self.hand_acceleration:
            raise ConfigError(
                f"partner_acceleration = {self.partner_acceleration}",
                expected=f"less than hand_acceleration = {self.hand_acceleration}",
            )


@dataclass(frozen=True, eq=False)
class Filtered:
    """What the filter made of a wanted acceleration.

    Attributes:
        acceleration: Shape (3,) [m/s²].
        changed: Whether the barrier changed it.
        margin: h before the step [m].
    """

    acceleration: FloatArray
    changed: bool
    margin: float


def keep_separation(
    wanted: FloatArray,
    offset: FloatArray,
    velocity: FloatArray,
    dt: float,
    config: SeparationConfig,
    *,
    age: float = 0.0,
) -> Filtered:
    """The acceleration nearest to the wanted one that keeps the separation.

    Args:
        wanted: Acceleration of the hand (3,) [m/s²].
        offset: Hand minus partner's hand (3,) [m].
        velocity: Of the hand relative to the partner's (3,) [m/s].
        dt: Time for which the acceleration holds [s].
        config: Parameters.
        age: For how long the partner's hand has been extrapolated at constant velocity [s].
    """
    limited = _within(wanted, config.hand_acceleration)
    distance = math.sqrt(float(offset @ offset))
    if distance < 1e-9:
        return Filtered(limited, False, -config.separation)
    outward = offset / distance
    closing = config.partner_acceleration * age - float(outward @ velocity)
    distance -= 0.5 * config.partner_acceleration * age**2
    relative = config.hand_acceleration - config.partner_acceleration
    margin = distance - config.separation - max(closing, 0.0) ** 2 / (2.0 * relative)
    least = _least_outward(distance - config.separation, closing, dt, relative, config)
    along = float(outward @ limited)
    if along >= least:
        return Filtered(limited, False, margin)
    most = config.hand_acceleration
    least = min(least, most)
    # Across the line of both hands, as wanted, as far as the largest acceleration allows.
    across = limited - along * outward
    room = math.sqrt(max(most**2 - least**2, 0.0))
    length = math.sqrt(float(across @ across))
    if length > room:
        across = across * (room / length)
    return Filtered(least * outward + across, True, margin)


def _least_outward(
    room: float, closing: float, dt: float, relative: float, config: SeparationConfig
) -> float:
    """Smallest acceleration along n after which h >= 0 one step later, the partner at its worst.

    With u the acceleration, the closing speed is then c' = c + (a_p - u) dt, and the room
    r' = r - (c + c') dt / 2; wanted is r' - max(c', 0)² / (2 b) >= 0 with b the relative acceleration.
    """
    # r - c dt / 2 - c' dt / 2 - c'² / (2 b) = 0 for the largest closing speed that is allowed.
    left = room - 0.5 * closing * dt
    root = (0.5 * relative * dt) ** 2 + 2.0 * relative * left
    # Where even moving apart does not make up for it: as fast as may be.
    allowed = -0.5 * relative * dt + math.sqrt(root) if root >= 0.0 else -math.inf
    if allowed < 0.0:
        # c' <= 0 counts for nothing but the way: r - (c + c') dt / 2 >= 0.
        allowed = min(2.0 * room / dt - closing, 0.0)
    return config.partner_acceleration + (closing - allowed) / dt


def _within(vector: FloatArray, longest: float) -> FloatArray:
    length = math.sqrt(float(vector @ vector))
    return vector * (longest / length) if length > longest else vector
