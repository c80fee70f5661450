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

Of an arm, each joint and the place of each limb next to the hand are kept clear of, not only the
nearest: a fist may come from behind a forearm. Each gives a half-space of accelerations; the one nearest
to the wanted in all of them is found by Hildreth's method (1957). What is below, as a table, and boxes
are more of them, which rest.

Nothing can be promised when the partner is nearer than that to begin with, is faster than the hand
and chases it, or when the hand has nowhere to go: between two people, or in the bend of an arm, each of
whom it could keep clear of alone. Then people come before table and boxes, and none of them is missed by
much more than must be.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.bounds import nearest_allowed
from hri_planner.policy.limbs import places_of
from hri_prediction.compiled import njit
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


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
    approach: float = parameter(
        8.0,
        "share of h that may be used up a second: smaller brakes sooner and more gently; very large: "
        "as late as possible, with all that there is",
        unit="1/s",
        low=0.1,
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
        changed: Whether a barrier changed it.
    """

    acceleration: FloatArray
    changed: bool


@dataclass(frozen=True, eq=False)
class Places:
    """Places that the hand is kept clear of.

    Attributes:
        position: Shape (n, 3) [m].
        velocity: Shape (n, 3) [m/s].
        age: For how long each has been extrapolated at constant velocity (n,) [s].
    """

    position: FloatArray
    velocity: FloatArray
    age: FloatArray


NO_BOXES = np.zeros((0, 2, 3))
NO_BOUNDS = (np.zeros((0, 3)), np.zeros(0))
"""No bounds but those of tool, people, floor and boxes."""
NOWHERE = Places(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


def together(parts: Sequence[Places]) -> Places:
    """All of them."""
    if len(parts) == 1:
        return parts[0]
    return Places(
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.velocity for part in parts]),
        np.concatenate([part.age for part in parts]),
    )


def keep_separation(
    wanted: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    places: Places,
    dt: float,
    config: SeparationConfig,
    *,
    floor: float | None = None,
    boxes: FloatArray = NO_BOXES,
    margin: float = 0.0,
) -> Filtered:
    """The acceleration nearest to the wanted one that keeps the separation.

    Args:
        wanted: Acceleration of the hand (3,) [m/s²].
        position: Of the hand (3,) [m].
        velocity: Of the hand (3,) [m/s].
        places: Of people.
        dt: Time for which the acceleration holds [s].
        config: Parameters.
        floor: Height that the hand stays above [m]; none: any. People come before it.
        boxes: Centre and half the size of boxes, edges along the axes (k, 2, 3) [m]; people come first.
        margin: Distance from the boxes that is kept [m].
    """
    acceleration, changed = kept_apart(
        wanted,
        position,
        velocity,
        places.position,
        places.velocity,
        places.age,
        dt,
        config.separation,
        config.hand_acceleration,
        config.partner_acceleration,
        config.approach,
        -math.inf if floor is None else floor,
        boxes,
        margin,
        NO_BOUNDS[0],
        NO_BOUNDS[1],
    )
    return Filtered(acceleration, bool(changed))


def keep_separations(
    wanted: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    joints: FloatArray,
    speeds: FloatArray,
    dt: float,
    config: SeparationConfig,
) -> tuple[FloatArray, BoolArray]:
    """The same for many hands at once, each with one partner who is seen at this moment.

    Args:
        wanted: Accelerations of the hands (n, 3) [m/s²].
        position: Of the hands (n, 3) [m].
        velocity: Of the hands (n, 3) [m/s].
        joints: Of the partners' arms in order, or their hands alone (n, m, 3) [m].
        speeds: Of these (n, m, 3) [m/s].
        dt: Time for which accelerations hold [s].
        config: Parameters.

    Returns:
        Accelerations (n, 3) [m/s²], and which of them the barrier changed (n,).
    """
    kept = np.empty_like(wanted)
    changed = np.empty(len(wanted), dtype=np.bool_)
    _keep_separations(
        wanted,
        position,
        velocity,
        joints,
        speeds,
        dt,
        config.separation,
        config.hand_acceleration,
        config.partner_acceleration,
        config.approach,
        kept,
        changed,
    )
    return kept, changed


@njit
def _keep_separations(
    wanted: Any,
    position: Any,
    velocity: Any,
    joints: Any,
    speeds: Any,
    dt: float,
    separation: float,
    most: float,
    theirs: float,
    approach: float,
    kept: Any,
    changed: Any,
) -> None:
    seen_now = np.zeros(2 * joints.shape[1] - 1)
    for row in range(len(wanted)):
        places, moving = places_of(joints[row], speeds[row], position[row])
        kept[row], changed[row] = kept_apart(
            wanted[row],
            position[row],
            velocity[row],
            places,
            moving,
            seen_now,
            dt,
            separation,
            most,
            theirs,
            approach,
            -np.inf,
            NO_BOXES,
            0.0,
            NO_BOUNDS[0],
            NO_BOUNDS[1],
        )


@njit
def kept_apart(
    wanted: Any,
    position: Any,
    velocity: Any,
    places: Any,
    speeds: Any,
    ages: Any,
    dt: float,
    separation: float,
    most: float,
    theirs: float,
    approach: float,
    floor: float,
    boxes: Any,
    margin: float,
    links_outward: Any,
    links_least: Any,
) -> Any:
    """Acceleration (3,), and whether it is another one than the wanted.

    Further bounds, those of :mod:`hri_planner.policy.link_bounds`, come after people as boxes do.
    """
    count = len(places)
    bounds = count + 1 + len(boxes) + len(links_least)
    outward, least = np.zeros((bounds, 3)), np.full(bounds, -np.inf)
    for index in range(count):
        squares = 0.0
        for k in range(3):
            outward[index, k] = position[k] - places[index, k]
            squares += outward[index, k] ** 2
        distance = math.sqrt(squares)
        if distance < 1e-9:
            continue  # no direction leads away more than others
        closing = 0.0
        for k in range(3):
            outward[index, k] /= distance
            closing -= outward[index, k] * (velocity[k] - speeds[index, k])
        # Braking is gentle by what was seen, and in time for the worst that may have come since.
        room = distance - separation
        gentle = least_gentle(room, closing, most - theirs, theirs, approach)
        room -= 0.5 * theirs * ages[index] ** 2
        closing += theirs * ages[index]
        least[index] = max(gentle, least_outward(room, closing, dt, most - theirs, theirs))
    # What is below rests: all of the acceleration is there to stop before it.
    outward[count, 2] = 1.0
    if floor > -np.inf:
        room = max(position[2] - floor, -separation)
        gentle = least_gentle(room, -velocity[2], most, 0.0, approach)
        least[count] = max(gentle, least_outward(room, -velocity[2], dt, most, 0.0))
    for index in range(len(boxes)):
        bound = count + 1 + index
        room = from_box(position, boxes[index], outward[bound]) - margin
        closing = 0.0
        for k in range(3):
            closing -= outward[bound, k] * velocity[k]
        gentle = least_gentle(room, closing, most, 0.0, approach)
        least[bound] = max(gentle, least_outward(room, closing, dt, most, 0.0))
    for index in range(len(links_least)):
        bound = count + 1 + len(boxes) + index
        outward[bound], least[bound] = links_outward[index], links_least[index]
    length = math.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2)
    limited = wanted * (most / length) if length > most else wanted.copy()
    found = nearest_allowed(limited, outward, np.minimum(least, most), most, count)
    change = 0.0
    for k in range(3):
        change = max(change, abs(found[k] - limited[k]))
    return found, change > 1e-9


@njit
def from_box(position: Any, box: Any, outward: Any) -> float:
    """Distance from a box's surface, negative inside, and the direction (3,) that leads away from it."""
    squares, inside, face = 0.0, -np.inf, 0
    for k in range(3):
        off = position[k] - box[0, k]
        beyond = abs(off) - box[1, k]
        outward[k] = math.copysign(max(beyond, 0.0), off)
        squares += outward[k] * outward[k]
        if beyond > inside:
            inside, face = beyond, k
    if squares == 0.0:
        outward[face] = math.copysign(1.0, position[face] - box[0, face])
        return inside
    distance = math.sqrt(squares)
    for k in range(3):
        outward[k] /= distance
    return distance


@njit
def least_outward(room: float, closing: float, dt: float, relative: float, theirs: float) -> float:
    """Smallest acceleration along n after which h >= 0 one step later, the partner at its worst.

    With u the acceleration, the closing speed is then c' = c + (a_p - u) dt, and the room
    r' = r - (c + c') dt / 2; wanted is r' - max(c', 0)² / (2 b) >= 0 with b the relative acceleration.
    """
    # r - c dt / 2 - c' dt / 2 - c'² / (2 b) = 0 for the largest closing speed that is allowed.
    left = room - 0.5 * closing * dt
    root = (0.5 * relative * dt) ** 2 + 2.0 * relative * left
    # Where even moving apart does not make up for it: as fast as may be.
    allowed = -0.5 * relative * dt + math.sqrt(root) if root >= 0.0 else -np.inf
    if allowed < 0.0:
        # c' <= 0 counts for nothing but the way: r - (c + c') dt / 2 >= 0.
        allowed = min(2.0 * room / dt - closing, 0.0)
    return theirs + (closing - allowed) / dt


@njit
def least_gentle(
    room: float, closing: float, relative: float, theirs: float, approach: float
) -> float:
    """Smallest acceleration along n with which h falls no quicker than in proportion to itself.

    The other bound alone brakes at the last moment, with all there is. Here dh/dt >= -γ h (exponential
    barrier, Ames et al. 2019), where dh/dt = -c - c c' / b and c' = a_p - u.
    """
    if closing <= 0.0:
        return -np.inf
    margin = room - closing**2 / (2.0 * relative)
    return theirs + relative * (1.0 - approach * margin / closing)
