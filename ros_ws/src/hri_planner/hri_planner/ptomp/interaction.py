"""Learnt costs of moving beside somebody, by name, as the planner takes them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.layout import NEARNESS_COUNT
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.shipped import SHIPPED_COSTS

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Nearness:
    """What nearness costs in a case.

    Attributes:
        weights: Of the 25 distances, agent 1 being the robot (25,); their sum is 1, since the scale of
            learnt weights means nothing.
        length: Distance over which the cost falls to 1/e [m].
    """

    weights: FloatArray
    length: float


def find_nearness(name: str, path: str = "") -> Nearness:
    """What nearness costs in a case of a file of learnt costs.

    Unsmoothness, the 26th of the learnt costs, is left out: the planner has costs of its own for that,
    which are those of a robot's seven joints.

    Args:
        name: As ``case_3``.
        path: A file of ``scripts/learn_costs.py``; empty: the one that ships.

    Raises:
        ConfigError: naming the cases that there are; or when no nearness costs anything in this one.
        DataError: when the file is missing, damaged or something else.
    """
    file = Path(path or SHIPPED_COSTS)
    try:
        state = file.stat()
        written = state.st_mtime_ns, state.st_size
    except OSError:  # what reads it says so better
        written = 0, 0
    return _nearness(name, file, written)


@lru_cache(maxsize=32)
def _nearness(name: str, file: Path, written: tuple[int, int]) -> Nearness:
    """Of a file as it was written then: costs that are learnt anew are other ones."""
    costs = load_costs(file)
    if name not in costs.cases:
        raise ConfigError(
            f"interaction_costs {name!r}", expected="one of " + ", ".join(costs.cases)
        )
    weights = costs.cases[name].weights[:NEARNESS_COUNT]
    total = float(weights.sum())
    if total <= 0.0:
        some = [other for other, one in costs.cases.items() if one.weights[:NEARNESS_COUNT].any()]
        raise ConfigError(
            f"interaction_costs {name!r}: people were not found to avoid any nearness in it",
            expected="a case in which they do: " + (", ".join(some) or "this file has none"),
        )
    return Nearness(weights / total, costs.length)


def doubts_about(name: str, path: str = "") -> tuple[str, ...]:
    """What a file of learnt costs warns of, of a case or of all.

    Args:
        name: As ``case_3``; empty: no case is used.
        path: As for :func:`find_nearness`.

    Raises:
        DataError: when the file is missing, damaged or something else.
    """
    if not name:
        return ()
    costs = load_costs(path or SHIPPED_COSTS)
    others = tuple(f"{other}: " for other in costs.cases if other != name)
    return tuple(text for text in costs.warnings if not text.startswith(others))


def check_interaction(name: str, path: str) -> None:
    """Whether learnt costs can be had.

    Raises:
        ConfigError: when they cannot, with the reason.
    """
    if not name:
        if path:
            raise ConfigError(
                f"interaction_file = {path} without interaction_costs",
                expected="the name of a case",
            )
        return
    try:
        find_nearness(name, path)
    except DataError as error:
        raise ConfigError(f"interaction_file: {error.problem}", expected=error.expected) from error
