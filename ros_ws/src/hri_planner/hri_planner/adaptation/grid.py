"""The time steps and roll-outs among which adaptation chooses."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.situation import Situation

FloatArray = NDArray[np.float64]

STEP = 5
TIMESTEPS = tuple(range(10, 61, STEP))
"""TS, 11 values."""
ROLLOUTS = tuple(range(5, 61, STEP))
"""NT, 12 values."""
SHAPE = (len(TIMESTEPS), len(ROLLOUTS))
"""Of arrays over the grid."""


@dataclass(frozen=True)
class Cell:
    """A pair of parameters.

    Attributes:
        num_timesteps: TS.
        num_rollouts: NT.
    """

    num_timesteps: int
    num_rollouts: int

    @property
    def on_grid(self) -> bool:
        """Whether both lie on the grid."""
        return self.num_timesteps in TIMESTEPS and self.num_rollouts in ROLLOUTS

    @property
    def place(self) -> tuple[int, int]:
        """Indices in arrays over the grid; the cell must be on it."""
        return TIMESTEPS.index(self.num_timesteps), ROLLOUTS.index(self.num_rollouts)


CELLS = tuple(Cell(steps, rollouts) for steps in TIMESTEPS for rollouts in ROLLOUTS)
"""All of them, in the order of a flattened array over the grid."""


def cell_at(index: int) -> Cell:
    """The cell of an index of a flattened array over the grid."""
    return CELLS[index]


def clipped(values: ArrayLike) -> Cell:
    """The cell of real-valued TS and NT (2,): rounded down, as 42.87 to 42, and within the grid's range."""
    steps, rollouts = np.floor(np.asarray(values, dtype=float))
    return Cell(
        int(np.clip(steps, TIMESTEPS[0], TIMESTEPS[-1])),
        int(np.clip(rollouts, ROLLOUTS[0], ROLLOUTS[-1])),
    )


def with_cell(config: PtompConfig, cell: Cell) -> PtompConfig:
    """A planner's parameters with those of a cell."""
    return replace(config, num_timesteps=cell.num_timesteps, num_rollouts=cell.num_rollouts)


class Selection(Protocol):
    """Says which parameters a motion is planned with."""

    def choose(self, situation: Situation) -> Cell:
        """The parameters for a motion that starts in this situation."""
