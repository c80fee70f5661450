"""Encounters recorded from simulated dyads, by a simulated tracking system."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.encounters import Encounter, smoothed
from hri_sim.dyads.drawing import draw_reaches
from hri_sim.dyads.hands import STEP_S, Reaches, simulate
from hri_sim.dyads.setups import DyadSetup

FloatArray = NDArray[np.float64]

SECONDS = 4.5
"""From the first of the two onsets on."""
TRACKING_NOISE_M = 0.0003
"""Of a tracking system with passive markers, each coordinate."""

_AT_REST_M = 0.004
_REST_S = 0.1


def record(reaches: Reaches, rng: np.random.Generator) -> list[tuple[FloatArray, FloatArray]]:
    """Hands of learner and partner at the time step of policies, from the learner's onset to its rest.

    Args:
        reaches: What they do.
        rng: Draws muscles and tracking.

    Returns:
        For each pair (n, 3) and (n, 3) [m].
    """
    hands = simulate(reaches, SECONDS, rng)
    hands = hands + TRACKING_NOISE_M * rng.standard_normal(hands.shape)
    found = []
    for index, pair in enumerate(hands):
        away = np.linalg.norm(pair[:, 0] - pair[-50:, 0].mean(axis=0), axis=1) > _AT_REST_M
        begin = round(reaches.onset[index, 0] / STEP_S)
        moving = int(np.flatnonzero(away)[-1]) if away.any() else begin
        end = min(moving + round(_REST_S / STEP_S), len(pair) - 1)
        paths = [smoothed(pair[begin : end + 1, person], 1.0 / STEP_S) for person in range(2)]
        found.append((paths[0], paths[1]))
    return found


def draw_encounters(
    setups: Sequence[DyadSetup], count: int, rng: np.random.Generator
) -> list[Encounter]:
    """Encounters in each of some setups, with two people who are drawn for each of them.

    Args:
        setups: Where they are.
        count: Encounters of each setup.
        rng: Source of all randomness.
    """
    found = []
    for setup in setups:
        reaches = draw_reaches(setup, count, rng)
        home = setup.places[0, 0]
        for index, (hand, partner) in enumerate(record(reaches, rng)):
            backward = bool(np.linalg.norm(reaches.goal[index, 0] - home) < 0.03)
            found.append(Encounter(hand, partner, hand[-1], setup.name, backward, setup.name))
    return found
