"""Whether, when and how exactly hands reach their goals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

REACHED_M = 0.03
"""A goal is reached when the hand is nearer than this from then on."""


def reach_steps(positions: ArrayLike, goal: ArrayLike, reached: float = REACHED_M) -> FloatArray:
    """From which step on hands stay at their goals.

    Args:
        positions: Shape (..., steps, 3) [m].
        goal: Shape (..., 3) [m].
        reached: Largest distance that counts as there [m].

    Returns:
        Shape (...); NaN where a hand is not there at the end.
    """
    path = np.asarray(positions, dtype=float)
    away = np.linalg.norm(path - np.asarray(goal, dtype=float)[..., None, :], axis=-1) > reached
    first = path.shape[-2] - np.argmax(away[..., ::-1], axis=-1)
    first = np.where(away.any(axis=-1), first, 0)
    return np.where(away[..., -1], np.nan, first.astype(float))


@dataclass(frozen=True)
class Reaching:
    """Of many motions.

    Attributes:
        reached_share: That reach their goals, 0 to 1.
        reach_time_mse: Mean squared difference of reach times to recorded ones, where both reach; NaN
            if none does [s²].
        terminal_reached: Mean distance to the goal at the end, of those that reach; NaN if none [m].
        terminal_all: Of all [m].
        terminal_max: Largest of all [m].
    """

    reached_share: float
    reach_time_mse: float
    terminal_reached: float
    terminal_all: float
    terminal_max: float


def reaching(
    positions: ArrayLike, goal: ArrayLike, recorded_steps: ArrayLike, dt: float
) -> Reaching:
    """Compare motions with recordings.

    Args:
        positions: Of the motions (n, steps, 3) [m].
        goal: Shape (n, 3) [m].
        recorded_steps: Reach steps of the recordings (n,), see :func:`reach_steps`; NaN where a
            recorded hand did not stay.
        dt: Time step of both [s].
    """
    path, goals = np.asarray(positions, dtype=float), np.asarray(goal, dtype=float)
    steps = reach_steps(path, goals)
    there = np.isfinite(steps)
    away = np.linalg.norm(path[:, -1] - goals, axis=1)
    late = (steps - np.asarray(recorded_steps, dtype=float)) * dt
    late = late[np.isfinite(late)]
    return Reaching(
        reached_share=float(there.mean()),
        reach_time_mse=float(np.mean(late**2)) if len(late) else float("nan"),
        terminal_reached=float(away[there].mean()) if there.any() else float("nan"),
        terminal_all=float(away.mean()),
        terminal_max=float(away.max()),
    )
