"""Where robot and person go in a soak: any number of reaches among the places of one scene."""

from __future__ import annotations

import numpy as np

from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import ReachSpec, Scenario

PLACES = 3
HOME = -1
"""Where the person's hand is in the beginning."""
TOUR = (0, 1, 0, 2, 1, 2, 0)
"""Places one after the other, such that each way between two of them is gone once."""


def soak_scenario(seed: int) -> Scenario:
    """A drawn scene whose reaches are all ways between its places, so that the predictor learns each.

    The first is from where the hand is in the beginning; the others are ways of :data:`TOUR`.

    Args:
        seed: Draws the scene.

    Raises:
        PlanningError: when none is found.
    """
    drawn = draw_scenario(seed, PLACES)
    reaches = tuple(
        drawn.reaches[place].model_copy(update={"start": 0.0}) for place in (TOUR[0], *TOUR[1:])
    )
    return drawn.model_copy(update={"reaches": reaches, "name": f"soak_{seed}"})


class Walk:
    """Chooses the next reach at random, among those that begin where the person's hand is.

    Args:
        scenario: One of :func:`soak_scenario`.
        rng: Source of all randomness.

    Attributes:
        place: Where the hand is, a number of a place; :data:`HOME`: where it was in the beginning.
    """

    def __init__(self, scenario: Scenario, rng: np.random.Generator) -> None:
        self._reaches = scenario.reaches
        self._rng = rng
        self._before = self.place = HOME

    def next(self) -> ReachSpec:
        """The next reach; the hand is at its target afterwards."""
        ends = (HOME, *TOUR)
        ways = [index for index in range(len(TOUR)) if ends[index] == self.place]
        index = ways[int(self._rng.integers(len(ways)))]
        self._before, self.place = self.place, TOUR[index]
        return self._reaches[index]

    def home(self) -> None:
        """The hand is where it was in the beginning."""
        self._before = self.place = HOME

    def back(self) -> None:
        """The hand goes back to where it was before the last reach."""
        self.place = self._before

    def other(self, reach: ReachSpec) -> ReachSpec:
        """A reach to another place."""
        others = [one for one in self._reaches if one.robot_target != reach.robot_target]
        return others[int(self._rng.integers(len(others)))]
