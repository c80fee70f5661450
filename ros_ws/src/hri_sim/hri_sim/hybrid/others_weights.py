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
    usual, pairs = load_process(), []
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
        for each in own:
            both = zip(_errors(each, usual), _errors(each, process), strict=True)
            # Of a reach that one of the two expects nothing of, nothing is compared.
            pairs += [pair for pair in both if None not in pair]
    if not pairs:
        raise DataError("nothing can be expected of any reach by both")
    shipped, others = 100.0 * np.array(pairs, dtype=float).mean(axis=0)
    return {"shipped_cm": float(shipped), "others_cm": float(others), "reaches": len(pairs)}


def _errors(each: Repeated, people: WeightProcess) -> list[float | None]:
    """Of each reach as the first one [m]; none where nothing can be expected."""
    found: list[float | None] = []
    for reach in each.reaches:
        try:
            person, key = first_guess(each, reach, people, unknown=reach)
        except HriError:
            found.append(None)
            continue
        model = person.rules.model(person.tasks[key], *person.usual_duration())
        found.append(told(model, reach).warped_m)
    return found
