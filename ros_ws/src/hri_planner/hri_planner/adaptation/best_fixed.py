"""The one cell that is best for all conditions: what adaptation has to beat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.grid import SHAPE, Cell, cell_at
from hri_planner.ptomp.situation import Situation
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class BestFixed:
    """The same cell whatever the situation."""

    cell: Cell

    def choose(self, situation: Situation) -> Cell:
        """The cell."""
        return self.cell

    def to_arrays(self) -> dict[str, FloatArray]:
        """What is saved."""
        return {"cell": np.array([self.cell.num_timesteps, self.cell.num_rollouts], dtype=float)}

    @classmethod
    def shapes(cls, arrays: dict[str, Any]) -> dict[str, tuple[int, ...]]:
        """Of the arrays of a file."""
        return {"cell": (2,)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, FloatArray]) -> BestFixed:
        """What was saved.

        Raises:
            ValueError: when it is no cell of the grid.
        """
        steps, rollouts = arrays["cell"]
        cell = Cell(int(steps), int(rollouts))
        if not cell.on_grid:
            raise ValueError(f"cell ({steps:g}, {rollouts:g}) is not on the grid")
        return cls(cell)


def best_fixed(cells: IntArray, success: FloatArray, cost: FloatArray) -> BestFixed:
    """The cell of the highest share of successes, of several the one of the least mean cost.

    Shares and costs are those of a cell and its up to eight neighbours together: with a few dozen
    motions a cell, the best of 132 shares would be the luckiest.

    Args:
        cells: Index of the cell of each motion (n,) in a flattened array over the grid.
        success: Whether it succeeded (n,), 0 or 1.
        cost: Its cost (n,); that of failures does not count.

    Raises:
        DataError: when there are no motions, or none succeeded.
    """
    if not np.any(success > 0.0):
        raise DataError(f"none of {len(success)} motions succeeded")
    size = SHAPE[0] * SHAPE[1]
    tried = _with_neighbours(np.bincount(cells, minlength=size))
    good = _with_neighbours(np.bincount(cells, success, minlength=size))
    spent = _with_neighbours(np.bincount(cells, np.where(success > 0.0, cost, 0.0), minlength=size))
    share = np.where(tried > 0.0, good / np.maximum(tried, 1.0), -1.0)
    mean = np.where(good > 0.0, spent / np.maximum(good, 1.0), np.inf)
    return BestFixed(cell_at(int(np.lexsort((mean, -share))[0])))


def _with_neighbours(values: NDArray[np.generic]) -> FloatArray:
    """Sums (132,) over each cell and its neighbours."""
    padded = np.pad(np.reshape(values, SHAPE).astype(float), 1)
    rows, columns = SHAPE
    total = sum(padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3))
    return np.asarray(total).ravel()
