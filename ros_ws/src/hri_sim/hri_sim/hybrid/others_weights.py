"""Whether weights that explain other recorded people make a better first guess than those that ship."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from hri_prediction.errors import DataError, HriError
from hri_prediction.hybrid.fitting import LEAST_REACHES, fit_process
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess
from hri_prediction.hybrid.why import Why
from hri_sim.hybrid.real import Repeated, first_guess
from hri_sim.hybrid.scores import told


def others_weights(
    repeated: Sequence[Repeated], whys: Mapping[tuple[str, str], Why | str]
) -> dict[str, Any]:
    """Errors before any reach was seen, by weights that ship and by those of all other people.

    Args:
        repeated: Reaches of all people.
        whys: What explains them, by person and target.

    Returns:
        ``shipped_cm``, ``others_cm``: means over reaches, the rest of the path after 30 %, target and
        duration told; ``reaches``: of how many.

    Raises:
        DataError: of too few people for a process of weights is known why they reach as they do.
    """
    people = sorted({each.person.split()[0] for each in repeated})
    shipped: list[float] = []
    others: list[float] = []
    for who in people:
        known = [
            why.data
            for (person, _), why in sorted(whys.items())
            if isinstance(why, Why) and person.split()[0] != who
        ]
        if len(known) < LEAST_REACHES:
            raise DataError(
                f"{len(known)} reaches of people other than {who} are explained",
                expected=f"{LEAST_REACHES} or more",
            )
        own = [each for each in repeated if each.person.split()[0] == who]
        process = fit_process(reduce(WeightData.and_also, known))
        for by, errors in ((load_process(), shipped), (process, others)):
            errors += [error for each in own for error in _errors(each, by)]
    return {
        "shipped_cm": 100.0 * float(np.mean(shipped)),
        "others_cm": 100.0 * float(np.mean(others)),
        "reaches": len(others),
    }


def _errors(each: Repeated, people: WeightProcess) -> list[float]:
    """Of each reach as the first one [m]; none where nothing can be expected."""
    found = []
    for reach in each.reaches:
        try:
            person, key = first_guess(each, reach, people)
        except HriError:
            continue
        model = person.rules.model(person.tasks[key], *person.usual_duration())
        found.append(told(model, reach).warped_m)
    return found
