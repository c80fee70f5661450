"""Dynamic potential field: the tool is pushed aside by what it moves towards (Park et al. 2008).

With x from the nearest place of an obstacle to the tool, v the tool's velocity relative to that place,
c = cos(x, v) and p the distance of the surfaces, an obstacle that is approached (c < 0) has the potential
U = lambda (-c)^b |v| / p; the acceleration is that of falling in it, with v held (the thesis's equations
7.10 to 7.12)::

    phi = lambda (-c)^(b-1) (|v| / p) [b grad c - (c / p) grad p]

Exactly head-on grad c is zero and a tool would only be braked: then, and nearly then, the velocity is
taken to point a little aside, the same way each time. The field grows with the speed and keeps no
distance for certain; the filter of :mod:`hri_planner.policy.separation` does that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.policy.limbs import share_along
from hri_prediction.compiled import njit
from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

ASIDE = 0.1
"""Sine of the angle to straight on, below which the tool is taken to move aside by as much."""
_SAME = 1e-6
_SLOWEST = 1e-6
"""Relative speeds below this are none [m/s]."""


@dataclass(frozen=True)
class FieldConfig:
    """Parameters of the field.

    Raises:
        ConfigError: when a value is out of range.
    """

    strength: float = parameter(
        0.10, "lambda: how strongly obstacles push; 0: not at all", unit="m^2/s", low=0.0, high=10.0
    )
    exponent: float = parameter(
        2.0, "b: the larger, the less what is not straight ahead counts", low=2.0, high=10.0
    )
    nearest: float = parameter(
        0.02, "distances of surfaces below this count as this", unit="m", low=1e-3, high=0.5
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)


@dataclass(frozen=True, eq=False)
class Obstacles:
    """What is to be kept clear of; arrays are C-contiguous.

    Attributes:
        axes: Of capsules (m, 2, 3) [m].
        speeds: Of the ends of these (m, 2, 3) [m/s].
        radii: Of capsules and tool together (m,) [m].
        boxes: Centre and half the size of static boxes, whose edges are along the axes (k, 2, 3) [m].
        margin: Radius of the tool, for boxes [m].
    """

    axes: FloatArray
    speeds: FloatArray
    radii: FloatArray
    boxes: FloatArray
    margin: float

    @staticmethod
    def of(
        axes: ArrayLike = (), speeds: ArrayLike | None = None, radii: ArrayLike = (),
        boxes: ArrayLike = (), margin: float = 0.0,
    ) -> Obstacles:  # fmt: skip
        """Obstacles from anything array-like; capsules without speeds rest.

        Raises:
            DataError: when shapes do not fit, or a value is not finite.
        """
        ends = np.array(axes, dtype=float).reshape(-1, 2, 3)
        moving = np.zeros_like(ends) if speeds is None else np.array(speeds, dtype=float)
        wide = np.array(radii, dtype=float).reshape(-1)
        blocks = np.array(boxes, dtype=float).reshape(-1, 2, 3)
        if moving.shape != ends.shape or len(wide) != len(ends):
            raise DataError(
                f"{len(ends)} capsules, speeds {moving.shape}, {len(wide)} radii",
                expected="speeds of both ends and a radius for each",
            )
        if not all(np.isfinite(values).all() for values in (ends, moving, wide, blocks)):
            raise DataError("an obstacle is not finite", expected="metres and m/s")
        return Obstacles(ends, moving, wide, blocks, margin)


def acceleration(
    position: ArrayLike, velocity: ArrayLike, obstacles: Obstacles, config: FieldConfig
) -> FloatArray:
    """All obstacles' push (3,) [m/s²] on a tool at a position (3,) [m] with a velocity (3,) [m/s]."""
    found = np.zeros(3)
    push(
        np.array(position, dtype=float),
        np.array(velocity, dtype=float),
        obstacles.axes,
        obstacles.speeds,
        obstacles.radii,
        obstacles.boxes,
        obstacles.margin,
        (config.strength, config.exponent, config.nearest),
        found,
    )
    return found


def potential(
    position: ArrayLike, velocity: ArrayLike, obstacles: Obstacles, config: FieldConfig
) -> float:
    """U of all obstacles; velocities of their nearest places are those at this position."""
    total = 0.0
    at, moving = np.array(position, dtype=float), np.array(velocity, dtype=float)
    for index, axis in enumerate(obstacles.axes):
        share = share_along(axis[0], axis[1], at)
        place = (1.0 - share) * axis[0] + share * axis[1]
        own = (1.0 - share) * obstacles.speeds[index, 0] + share * obstacles.speeds[index, 1]
        total += _potential(at - place, moving - own, float(obstacles.radii[index]), config)
    for centre, half in obstacles.boxes:
        x = at - np.clip(at, centre - half, centre + half)
        total += _potential(x, moving, obstacles.margin, config)
    return total


def _potential(x: FloatArray, v: FloatArray, radius: float, config: FieldConfig) -> float:
    length, speed = float(np.linalg.norm(x)), float(np.linalg.norm(v))
    if length < _SAME or speed < _SLOWEST:
        return 0.0
    cosine = float(v @ x) / (length * speed)
    p = max(length - radius, config.nearest)
    return config.strength * max(-cosine, 0.0) ** config.exponent * speed / p


@njit
def push(
    position: Any,
    velocity: Any,
    axes: Any,
    speeds: Any,
    radii: Any,
    boxes: Any,
    margin: float,
    config: Any,
    out: Any,
) -> None:
    """Add the acceleration of all obstacles to ``out`` (3,) [m/s²]."""
    x, v, along, fixed = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for index in range(len(axes)):
        share = share_along(axes[index, 0], axes[index, 1], position)
        squares = 0.0
        for k in range(3):
            along[k] = axes[index, 1, k] - axes[index, 0, k]
            squares += along[k] * along[k]
            x[k] = position[k] - axes[index, 0, k] - share * along[k]
            moving = (1.0 - share) * speeds[index, 0, k] + share * speeds[index, 1, k]
            v[k] = velocity[k] - moving
        # Along its axis, the nearest place of a capsule goes with the tool.
        inside = 0.0 < share < 1.0
        for k in range(3):
            along[k] = along[k] / math.sqrt(squares) if inside else 0.0
            fixed[k] = 1.0
        _push_one(x, v, along, fixed, radii[index], config, out)
    along[:] = 0.0
    for index in range(len(boxes)):
        for k in range(3):
            off = position[k] - boxes[index, 0, k]
            beside = abs(off) > boxes[index, 1, k]
            x[k] = off - math.copysign(boxes[index, 1, k], off) if beside else 0.0
            # Beside a face, its nearest place goes with the tool in the directions of the face.
            fixed[k] = 1.0 if beside else 0.0
            v[k] = velocity[k]
        _push_one(x, v, along, fixed, margin, config, out)


@njit
def _push_one(x: Any, v: Any, along: Any, fixed: Any, radius: float, config: Any, out: Any) -> None:
    """Of one obstacle; gradients do not count along the unit vector ``along``, nor where ``fixed`` is 0."""
    strength, exponent, nearest = config
    length, speed, dot = 0.0, 0.0, 0.0
    for k in range(3):
        length += x[k] * x[k]
        speed += v[k] * v[k]
        dot += x[k] * v[k]
    length, speed = math.sqrt(length), math.sqrt(speed)
    if length < _SAME or speed < _SLOWEST or dot >= 0.0:
        return
    cosine = dot / (length * speed)
    p = max(length - radius, nearest)
    slope = 1.0 if length - radius > nearest else 0.0
    ahead, gradient = np.empty(3), np.empty(3)
    _aside(x, v, along, length, speed, cosine, ahead)
    through = 0.0
    for k in range(3):
        gradient[k] = exponent * (ahead[k] - cosine * x[k] / length) / length
        gradient[k] -= cosine / p * slope * x[k] / length
        through += gradient[k] * along[k]
    size = strength * (-cosine) ** (exponent - 1.0) * speed / p
    for k in range(3):
        out[k] += size * fixed[k] * (gradient[k] - through * along[k])


@njit
def _aside(
    x: Any, v: Any, along: Any, length: float, speed: float, cosine: float, out: Any
) -> None:
    """Direction of v; nearly straight on to the obstacle, one that is a little more aside.

    Along the axis of a capsule is not aside.
    """
    lateral = np.empty(3)
    on = 0.0
    for k in range(3):
        out[k] = v[k] / speed
        lateral[k] = out[k] - cosine * x[k] / length
        on += lateral[k] * along[k]
    sine = 0.0
    for k in range(3):
        lateral[k] -= on * along[k]
        sine += lateral[k] * lateral[k]
    sine = math.sqrt(sine)
    if sine >= ASIDE:
        return
    if sine < _SAME:
        _tie_break(x, along, length, lateral)
        sine = 1.0
    for k in range(3):
        out[k] = cosine * x[k] / length + on * along[k] + ASIDE * lateral[k] / sine


@njit
def _tie_break(x: Any, along: Any, length: float, out: Any) -> None:
    """A unit vector aside of x and of an axis: over the obstacle, or where that cannot be to its side."""
    if along[0] != 0.0 or along[1] != 0.0 or along[2] != 0.0:
        sign = 1.0
        for k in range(3):
            out[k] = (along[k - 2] * x[k - 1] - along[k - 1] * x[k - 2]) / length
        for k in range(3):
            if abs(out[k]) > _SAME:
                sign = math.copysign(1.0, out[k])  # the last that counts: up before aside
        for k in range(3):
            out[k] *= sign
        return
    up, squares = 2 if abs(x[2]) < 0.9 * length else 1, 0.0
    for k in range(3):
        out[k] = (1.0 if k == up else 0.0) - x[up] * x[k] / (length * length)
        squares += out[k] * out[k]
    for k in range(3):
        out[k] /= math.sqrt(squares)
