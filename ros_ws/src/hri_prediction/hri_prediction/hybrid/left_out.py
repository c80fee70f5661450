"""How far off expected weights are of people who were not learnt from."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import SIDES
from hri_prediction.hybrid.fitting import fit_process
from hri_prediction.hybrid.of_laws import data_of_laws
from hri_prediction.hybrid.weight_process import WeightData, to_alpha

Array = NDArray[np.float64]
Law = Mapping[str, Any]

LEAST_PEOPLE = 3
"""With fewer, what is left when one is left out says nothing of people."""


def reaches_left_out(data: WeightData, person: Sequence[str], seed: int = 0) -> tuple[float, float]:
    """Mean absolute error of weights of reaches of people who are left out, each in turn.

    A person's other reaches, and other repetitions of a task, would give theirs away.

    Args:
        data: Weights of reaches of :data:`LEAST_PEOPLE` people or more.
        person: Whose each is.
        seed: Of the starts of the search.

    Returns:
        Of a process, and of the mean, of what is left.
    """
    names = np.array(person)
    return _errors(
        [
            (data.where(np.flatnonzero(names != who)), data.where(np.flatnonzero(names == who)))
            for who in dict.fromkeys(person)
        ],
        seed,
    )


def people_left_out(
    names: tuple[str, ...], laws: Sequence[Law], seed: int = 0
) -> tuple[float, float]:
    """Mean absolute error of the weights by which people reach that are left out, each in turn.

    Args:
        names: Costs.
        laws: Of :data:`LEAST_PEOPLE` people or more, see :func:`data_of_laws`.
        seed: Of the starts of the search.

    Returns:
        Of a process, and of the mean, of the other people.
    """
    people = by_person(laws)
    own = (data_of_laws(names, people[who]) for who in people)
    return _errors(list(zip(without_each(names, laws), own, strict=True)), seed)


def without_each(names: tuple[str, ...], laws: Sequence[Law]) -> list[WeightData]:
    """Weights of all people but one, each left out in turn; tasks that nobody else did are missing.

    Args:
        names: Costs.
        laws: Of two people or more.
    """
    people = by_person(laws)
    return [
        data_of_laws(names, [law for other in people if other != who for law in people[other]])
        for who in people
    ]


def by_person(laws: Sequence[Law]) -> dict[str, list[Law]]:
    """Laws of each person: of both arms, whose names differ by the side alone."""
    found: dict[str, list[Law]] = defaultdict(list)
    for number, law in enumerate(laws):
        found[whose(str(law.get("person", number)))].append(law)
    return dict(found)


def whose(arm: str) -> str:
    """The person of an arm, as ``scripts/fit_ioc.py`` names it."""
    for side in SIDES:
        arm = arm.removesuffix(f" {side}")
    return arm


def _errors(parts: Sequence[tuple[WeightData, WeightData]], seed: int) -> tuple[float, float]:
    """Of what is fitted to the first of each, held against the second: means over the parts."""
    own, plain = [], []
    for rest, held in parts:
        process = fit_process(rest, seed)
        truth = to_alpha(held.logs, held.names)
        mean = to_alpha(rest.logs, rest.names).mean(axis=0)
        guesses = np.array([process.guess(row[:3], row[3:]).alpha for row in held.inputs])
        own.append(np.abs(guesses - truth).mean())
        plain.append(np.abs(mean - truth).mean())
    return float(np.mean(own)), float(np.mean(plain))
