"""Movements that are optimal for costs which are set by hand, by the edges of a case: learning's own test.

Hands of simulated people give way to each other in place and time (:mod:`hri_sim.dyads`), and their arms
follow the hands, so that by how arms are held nobody avoids anything. Here such movements are bent, their
ends held, until they are optimal for costs that are known: everybody keeps the own hand from the other's,
and each edge of the case adds what it brings near. What is learnt from them can be held against what they
were made with. They are no movements of people: nothing but unsmoothness and nearness counts, so that lifts
are lost, and hands may go through a table.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.ontology.cases import Case
from hri_prediction.ontology.features import COUNT, FEATURES
from hri_prediction.ontology.graph import CROSSING, OVER, SHARED
from hri_prediction.ontology.movements import Movement, cost_scale
from hri_prediction.ontology.synthetic import optimal_movement

FloatArray = NDArray[np.float64]

ALWAYS = ("hand-hand",)
BY_EDGE = {
    **dict.fromkeys(SHARED, ("elbow-hand tip", "hand tip-elbow")),
    **dict.fromkeys(OVER, ("forearm-hand", "hand-forearm")),
    CROSSING: ("forearm-forearm",),
}
"""Nearness that each edge adds to what is avoided. Movements of both agents are learnt from as agent 1's,
so both orders count, and cases that differ in whose spaces are gone over (4 and 5, 8 and 9) are alike."""
SMOOTHNESS_SHARE = 20.0
"""Of unsmoothness, where the nearness that differs most among what might be done counts for 1: so much that
nearness bends an arm by some centimetres."""
_SCALED_BY = 20
"""Movements that costs are compared beside."""


def shares_of(case: Case) -> FloatArray:
    """How much each nearness is avoided in a case (25,): 1 for hands, and 1 for each edge."""
    shares = np.zeros(COUNT)
    for name in ALWAYS:
        shares[FEATURES.index(name)] += 1.0
    for edge in case.edges:
        for name in BY_EDGE[edge]:
            shares[FEATURES.index(name)] += 1.0
    return shares


def truth_of(
    case: Case, movements: Sequence[Movement], spread: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Weights of the costs that people of a case move by (26,).

    A second of nearness costs the same whatever is near, times its share: 1 for hands, and 1 for each
    edge. Unsmoothness counts twenty times as much as the nearness that differs most among what might be
    done beside the movements as they are given: beside those that are bent by these costs it is another
    ratio.

    Args:
        case: Which.
        movements: Beside which costs are compared, one at least; of twenty at most, spread over all.
        spread: How far what might be done is (14,).
        rng: Draws it.

    Raises:
        DataError: without movements.
    """
    if not movements:
        raise DataError(f"no movements of {case.name}", expected="one at least")
    some = np.unique(np.linspace(0, len(movements) - 1, _SCALED_BY).astype(int))
    scale = cost_scale([movements[k] for k in some], rng, spread)
    shares = shares_of(case)
    return np.append(
        shares / scale[:COUNT][shares > 0.0].max(), SMOOTHNESS_SHARE / max(scale[COUNT], 1e-300)
    )


def avoiding(
    case: Case, movements: Sequence[Movement], spread: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, list[Movement]]:
    """The costs that people of a case move by (26,), and movements that are optimal for them.

    Args:
        case: Which.
        movements: Where people begin and end, and beside whom, one at least.
        spread: How far they might move otherwise (14,); joints without any stay as they were.
        rng: Draws what costs are compared by.
    """
    truth = truth_of(case, movements, spread, rng)
    free = spread > 0.0
    return truth, [optimal_movement(movement, truth, free=free) for movement in movements]
