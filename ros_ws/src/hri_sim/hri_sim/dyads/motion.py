"""Two people who reach turn after turn, resting between, as time goes on."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_sim.dyads.drawing import SCATTER_M, PersonFactors, draw_person, reaches_between
from hri_sim.dyads.hands import STEP_S, Reaches, moving
from hri_sim.dyads.recording import SECONDS
from hri_sim.dyads.setups import DyadSetup

FloatArray = NDArray[np.float64]

_KEPT = 128
"""Steps that can still be asked for."""

_REST_S = 0.2
_SAME_PLACE_M = 0.05
_TURN_S = (0.25, 0.7)
"""So long after who leaves a place sets off who comes to it."""
_AT_REST_M = 0.002
"""Who moves less than this in that time has arrived."""


class DyadMotion:
    """Hands of two people at any step of 4 ms, in the order of time.

    Both begin at home. In each encounter either goes to another of the own places; when both have
    arrived, they rest, and so on.

    Args:
        setup: Where they are.
        rng: Draws who they are and all that they do.
        pause: How long they rest between encounters [s].
        encounters: How many there are; 0: there is no end.
        people: Who they are; drawn if none are given.

    Attributes:
        begun: Encounters that have begun.
        over: Whether there will be none any more.
    """

    def __init__(
        self,
        setup: DyadSetup,
        rng: np.random.Generator,
        *,
        pause: float,
        encounters: int = 0,
        people: tuple[PersonFactors, PersonFactors] | None = None,
    ) -> None:
        self.setup = setup
        self.begun = 0
        self.over = False
        self.resting = True
        self._rng = rng
        self._pause_steps = round(pause / STEP_S)
        self._encounters = encounters
        self._people = people or (draw_person(rng), draw_person(rng))
        self._step = -1
        self._kept: deque[FloatArray] = deque(maxlen=_KEPT)
        self._coming = self._run()
        self.reaches: Reaches | None = None

    def at(self, step: int) -> FloatArray:
        """Hands of learner and partner (2, 3) [m], frame of the setup.

        Args:
            step: From 0; at most 127 before the latest that was asked for.

        Raises:
            DataError: when it is longer ago.
        """
        while self._step < step:
            self._kept.append(next(self._coming))
            self._step += 1
        back = self._step - step
        if step < 0 or back >= len(self._kept):
            raise DataError(f"step {step} after step {self._step}", expected="a later one")
        return self._kept[-1 - back]

    def _run(self) -> Iterator[FloatArray]:
        """All steps."""
        at_place = np.zeros(2, dtype=int)
        hands = self.setup.places[:, 0].copy()
        while True:
            for _ in range(self._pause_steps):
                yield hands
            if self._encounters and self.begun == self._encounters:
                self.over = True
                while True:
                    yield hands
            goals, before = np.empty((2, 3)), hands
            for person, places in enumerate(self.setup.places):
                others = np.delete(np.arange(len(places)), at_place[person])
                at_place[person] = self._rng.choice(others)
                goals[person] = places[at_place[person]]
            goals += SCATTER_M * self._rng.standard_normal((2, 3))
            reaches = reaches_between(self._people, hands[None], goals[None], self._rng)
            self.reaches = replace(
                reaches,
                bow=self.setup.bow[None],
                onset=self._by_turns(reaches.onset, before, goals),
            )
            self.begun += 1
            self.resting = False
            latest = float((self.reaches.onset + self.reaches.duration).max())
            past: deque[FloatArray] = deque(maxlen=round(_REST_S / STEP_S))
            for step, (hands,) in enumerate(moving(self.reaches, SECONDS, self._rng)):
                yield hands
                past.append(hands)
                stirred = np.linalg.norm(hands - past[0], axis=1)
                if step * STEP_S > latest and (stirred < _AT_REST_M).all():
                    break
            self.resting = True

    def _by_turns(self, onset: FloatArray, hands: FloatArray, goals: FloatArray) -> FloatArray:
        """When they set off (1, 2) [s]: nobody comes to where the other still is."""
        comes = [
            bool(np.linalg.norm(goals[person] - hands[1 - person]) < _SAME_PLACE_M)
            for person in range(2)
        ]
        if not any(comes):
            return onset
        # Where both swap places, either goes first.
        late = int(self._rng.integers(2)) if all(comes) else comes.index(True)
        found = np.zeros((1, 2))
        found[0, late] = self._rng.uniform(*_TURN_S)
        return found
