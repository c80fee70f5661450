"""The configurations of table 5.2, by number."""

from __future__ import annotations

from dataclasses import dataclass, replace

from hri_planner.rnn.training.config import TrainingConfig


@dataclass(frozen=True)
class Job:
    """A policy to be trained.

    Attributes:
        name: Of its files.
        data: Name of the set that it learns from, or path of a recording.
        config: How.
        learner: Whose reaches of a recording are learnt; empty: all.
    """

    name: str
    data: str
    config: TrainingConfig
    learner: str = ""


CLUSTERS = (
    ((5, 5), "D1"),
    ((8, 8), "D1"),
    ((9, 9), "D1"),
    ((7, 7), "D2"),
    ((9, 9), "D2"),
    ((9, 9), "D3-1"),
    ((9, 9), "D3-2"),
    ((9, 9), "D3-3"),
)
"""Units of both layers and data, in the order of the table; each with the three kinds of cells."""

CELLS = ("gru3t", "gru", "lstm")


def table_jobs(config: TrainingConfig) -> list[Job]:
    """C1 to C24.

    Args:
        config: Of all; cell and units are replaced.
    """
    return [
        Job(f"C{3 * cluster + index + 1}", data, replace(config, cell=cell, units=units))
        for cluster, (units, data) in enumerate(CLUSTERS)
        for index, cell in enumerate(CELLS)
    ]
