"""Encounters to learn from, made without the simulation of people."""

import numpy as np

from hri_planner.rnn.encounters import Encounter


def some_encounters(count: int, seed: int = 0, samples: int = 24) -> list[Encounter]:
    """Minimum-jerk reaches of different lengths beside a partner who crosses."""
    rng = np.random.default_rng(seed)
    found = []
    for index in range(count):
        share = np.linspace(0.0, 1.0, samples + index % 5)[:, None]
        way = 10.0 * share**3 - 15.0 * share**4 + 6.0 * share**5
        start, goal = rng.uniform(-0.3, 0.3, (2, 3))
        bow = 0.06 * np.sin(np.pi * share) ** 3
        hand = start + way * (goal - start) + bow * np.array((0.0, 0.0, 1.0))
        crossing = 0.5 * (start + goal) + (share - 0.5) * rng.uniform(-0.5, 0.5, 3) + 0.05
        found.append(Encounter(hand, crossing, goal))
    return found
