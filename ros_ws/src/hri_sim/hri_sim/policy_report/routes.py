"""Many encounters on one way there and back, as the thesis' table 5.3 is about."""

from __future__ import annotations

import numpy as np

from hri_planner.rnn.encounters import Encounter
from hri_sim.dyads.drawing import draw_reaches
from hri_sim.dyads.recording import record
from hri_sim.dyads.setups import DyadSetup
from hri_sim.policies.meetings import taken

_DRAWN_A_WAY = 40
"""Of so many encounters drawn, one is on a given way, and some more."""


def on_one_way(
    setup: DyadSetup, count: int, rng: np.random.Generator
) -> tuple[list[Encounter], list[Encounter]]:
    """Encounters of two people in which the learner goes from home to the first target, and back.

    Args:
        setup: Where they are.
        count: Encounters of either.
        rng: Source of all randomness.
    """
    reaches = draw_reaches(setup, _DRAWN_A_WAY * (count + 10), rng)
    places = setup.places[0]

    def nearest(hands: np.ndarray) -> np.ndarray:
        apart = np.linalg.norm(hands[:, None] - places[None], axis=2)
        found: np.ndarray = apart.argmin(axis=1)
        return found

    begin, end = nearest(reaches.start[:, 0]), nearest(reaches.goal[:, 0])
    ways = []
    for leaving, going in ((0, 1), (1, 0)):
        rows = np.flatnonzero((begin == leaving) & (end == going))[:count]
        ways.append(
            [
                Encounter(hand, partner, hand[-1], setup.name, going == 0, setup.name)
                for hand, partner in record(taken(reaches, rows), rng)
            ]
        )
    return ways[0], ways[1]
