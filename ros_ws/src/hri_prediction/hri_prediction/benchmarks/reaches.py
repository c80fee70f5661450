"""Reaches to measure with: an arm that moves on minimum-jerk lines with scatter."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.promp.regression import Demonstration
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

UPPER_ARM, FOREARM, HAND = 0.29, 0.26, 0.09
SHOULDER = np.array([0.7, 0.2, 0.5])
HOME = np.array([-0.2, 0.0, -0.35])
TARGETS = {
    "near left": np.array([-0.35, -0.25, -0.1]),
    "near right": np.array([-0.35, 0.25, -0.1]),
    "far left": np.array([-0.45, -0.15, 0.05]),
    "far right": np.array([-0.45, 0.15, 0.05]),
}
"""Where the wrist goes, relative to the shoulder [m]."""
REST_S = 0.5


def draw_demonstrations(
    rng: np.random.Generator, count: int, points: int, dims: int
) -> list[Demonstration]:
    """Movements over the same phases: a minimum-jerk line, its end and a detour scattered, noise."""
    phases = np.linspace(0.0, 1.0, points)
    rise, bump = minimum_jerk(phases)[:, None], np.sin(np.pi * phases)[:, None]
    start, way = rng.uniform(-0.3, 0.3, dims), rng.uniform(-0.4, 0.4, dims)
    return [
        Demonstration(
            phases,
            start
            + rise * (way + 0.03 * rng.standard_normal(dims))
            + bump * 0.02 * rng.standard_normal(dims)
            + 0.002 * rng.standard_normal((points, dims)),
        )
        for _ in range(count)
    ]


def draw_reach(rng: np.random.Generator, task: str, trial: int, rate_hz: float) -> ArmTrack:
    """Rest, a reach of 0.9 s or so with the right arm, and rest again."""
    duration = 0.9 * np.exp(0.1 * rng.standard_normal())
    time = np.arange(0.0, duration + 2.0 * REST_S, 1.0 / rate_hz)
    rise = minimum_jerk((time - REST_S) / duration)[:, None]
    start = HOME + 0.005 * rng.standard_normal(3)
    end = TARGETS[task] + 0.01 * rng.standard_normal(3)
    wrist = start + rise * (end - start)
    wrist[:, 2] += 0.05 * np.sin(np.pi * rise[:, 0])
    distance = np.linalg.norm(wrist, axis=1, keepdims=True)
    axis = wrist / distance
    along = (UPPER_ARM**2 - FOREARM**2 + distance**2) / (2.0 * distance)
    down = np.array([0.0, 0.0, -1.0]) - axis * -axis[:, 2:]
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    elbow = axis * along + down * np.sqrt(np.maximum(UPPER_ARM**2 - along**2, 0.0))
    hand = wrist + (wrist - elbow) * (HAND / FOREARM)
    points = SHOULDER + np.stack([np.zeros_like(wrist), elbow, wrist, hand], axis=1)
    points += 0.0005 * rng.standard_normal(points.shape)
    return ArmTrack(time, points, "right", "drawn", task, trial, "drawn")
