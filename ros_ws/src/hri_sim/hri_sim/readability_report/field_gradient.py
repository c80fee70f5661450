"""Whether the potential field's acceleration is the slope of its potential."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.potential_field import (
    ASIDE,
    FieldConfig,
    Obstacles,
    acceleration,
    potential,
)

FloatArray = NDArray[np.float64]

COUNT, SMOKE_COUNT = 2000, 50
_STEP_M = 1e-4
_STREAM = 72


def field_gradient(smoke: bool) -> dict[str, Any]:
    """Largest difference of acceleration and finite differences, as a share of the larger of it and 1 m/s².

    Of capsules and boxes, places and velocities at random; where the field makes a tool that is nearly
    head-on give way aside it is no gradient, on purpose, and not looked at.
    """
    rng, config = np.random.default_rng(_STREAM), FieldConfig()
    worst, largest, count = 0.0, 0.0, SMOKE_COUNT if smoke else COUNT
    done = 0
    while done < count:
        place, velocity, obstacles = _draw(rng)
        if _near_a_kink(place, velocity, obstacles, config):
            continue
        done += 1
        made = acceleration(place, velocity, obstacles, config)
        size = float(np.linalg.norm(made))
        slope = _slope(place, velocity, obstacles, config)
        worst = max(worst, float(np.linalg.norm(made + slope)) / max(size, 1.0))
        largest = max(largest, size)
    return {"error": worst, "count": count, "largest_m_s2": largest}


def _draw(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, Obstacles]:
    """A tool near one obstacle; all of a capsule moves alike, as its ends' mixture is held with v."""
    place = rng.uniform(-0.3, 0.3, 3)
    velocity = rng.standard_normal(3)
    if rng.random() < 0.5:
        moving = np.tile(0.5 * rng.standard_normal(3), (1, 2, 1))
        ends = rng.uniform(-0.4, 0.4, (1, 2, 3))
        return place, velocity, Obstacles.of(ends, moving, [rng.uniform(0.02, 0.1)])
    box = np.array([[rng.uniform(-0.2, 0.2, 3), rng.uniform(0.02, 0.15, 3)]])
    return place, velocity, Obstacles.of(boxes=box, margin=rng.uniform(0.0, 0.08))


def _near_a_kink(
    place: FloatArray, velocity: FloatArray, obstacles: Obstacles, config: FieldConfig
) -> bool:
    """Whether differences would reach over an edge of the field: its definition changes there."""
    axis = np.zeros(3)
    if len(obstacles.boxes):
        centre, half = obstacles.boxes[0]
        off = np.abs(place - centre) - half
        if (np.abs(off) < 10.0 * _STEP_M).any():
            return True
        x, v, radius = (
            place - np.clip(place, centre - half, centre + half),
            velocity,
            obstacles.margin,
        )
    else:
        (first, second), radius = obstacles.axes[0], float(obstacles.radii[0])
        along = second - first
        share = float((place - first) @ along) / float(along @ along)
        if min(abs(share), abs(1.0 - share)) * np.linalg.norm(along) < 10.0 * _STEP_M:
            return True
        x = place - first - min(max(share, 0.0), 1.0) * along
        if 0.0 < share < 1.0:
            axis = along / np.linalg.norm(along)
        v = velocity - obstacles.speeds[0, 0]
    length, speed = float(np.linalg.norm(x)), float(np.linalg.norm(v))
    if length < radius + config.nearest + 10.0 * _STEP_M:
        return True
    cosine = float(x @ v) / (length * speed)
    # How far the tool moves aside of the obstacle; along the axis of a capsule is not aside.
    lateral = v / speed - cosine * x / length
    lateral -= (lateral @ axis) * axis
    # Nearly head-on, and where the tool neither approaches nor leaves.
    return float(np.linalg.norm(lateral)) < 2.0 * ASIDE or abs(cosine) < 0.05


def _slope(
    place: FloatArray, velocity: FloatArray, obstacles: Obstacles, config: FieldConfig
) -> FloatArray:
    """Of the potential (3,), by differences of fourth order."""
    slope = np.empty(3)
    for axis in range(3):
        values = [
            potential(place + factor * _STEP_M * np.eye(3)[axis], velocity, obstacles, config)
            for factor in (-2.0, -1.0, 1.0, 2.0)
        ]
        slope[axis] = (values[0] - 8.0 * values[1] + 8.0 * values[2] - values[3]) / (12.0 * _STEP_M)
    return slope
