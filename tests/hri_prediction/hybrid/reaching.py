"""Reaches of somebody who strays from the first guess by the same way every time."""

from __future__ import annotations

import numpy as np

from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.task import TaskKey


def reach_of(
    person: HybridPerson,
    rest: Rest,
    key: TaskKey,
    rng: np.random.Generator,
    *,
    aside: np.ndarray,
    scatter_m: float = 0.002,
    duration_s: float = 0.8,
) -> SeenReach:
    """One reach along the path that is expected of a task, and aside of it towards its end."""
    path = person.tasks[key].path
    away = np.outer(path.phases, np.tile(aside, 2))
    values = path.values + away + rng.normal(0.0, scatter_m, 6)
    return SeenReach(
        rest.body,
        path.phases,
        values,
        rest.points[0],
        rest.points[3],
        person.targets[key.target] + 0.01,
        duration_s,
    )
