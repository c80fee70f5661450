"""Random orders that keep what chance would keep: who somebody is, and what all have done.

Reaches of a person are alike, and so are those of all people to one target from one posture. Values in any
order at all would take them for independent, and make too much of small effects. So whole tasks change
places, in all people at once: what is exchanged is that in which the effect asked for is constant
(Anderson and ter Braak 2003, "Permutation tests for multi-factorial analysis of variance", J. Stat. Comput.
Simul. 73(2); Winkler et al. 2015, "Multi-level block permutation", NeuroImage 123).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError

Indices = NDArray[np.int64]


def random_orders(
    person: NDArray[Any], task: NDArray[Any], count: int, rng: np.random.Generator
) -> Indices:
    """Orders of N values in which tasks change places, the same ones in all people.

    Only tasks can that the same people did equally often; repetitions change places among themselves, too.

    Args:
        person: Who each value is of (N,).
        task: What was done (N,).
        count: Number of orders.
        rng: Source of randomness.

    Returns:
        Indices of the values in each order (count, N).

    Raises:
        DataError: when the lengths differ, or no two tasks can change places.
    """
    if person.shape != task.shape or person.ndim != 1:
        raise DataError(
            f"orders of {person.shape} people and {task.shape} tasks",
            expected="one of each a value",
        )
    who, what = (np.unique(each, return_inverse=True)[1].reshape(-1) for each in (person, task))
    times = np.zeros((what.max(initial=-1) + 1, who.max(initial=-1) + 1), dtype=int)
    np.add.at(times, (what, who), 1)
    orders = np.tile(np.arange(len(person), dtype=np.int64), (count, 1))
    alike = np.unique(times, axis=0, return_inverse=True)[1].reshape(-1)
    sizes = np.bincount(alike)
    if not (sizes > 1).any():
        raise DataError(
            f"{len(times)} tasks that were each done by other people, or otherwise often",
            expected="two or more that the same people did equally often",
        )
    for kind in np.flatnonzero(sizes > 1):
        tasks = np.flatnonzero(alike == kind)
        moved = rng.permuted(np.tile(np.arange(len(tasks)), (count, 1)), axis=1)
        for one in np.flatnonzero(times[tasks[0]]):
            own = who == one
            rows = np.stack([np.flatnonzero(own & (what == each)) for each in tasks])
            inner = rng.permuted(np.tile(np.arange(rows.shape[1]), (count, len(rows), 1)), axis=2)
            taken = np.take_along_axis(rows[moved], inner, axis=2)
            orders[:, rows.ravel()] = taken.reshape(count, -1)
    return orders
