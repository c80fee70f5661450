"""A person who takes part in an experiment: reads the robot, and reaches for the goal that is meant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import PlanningError
from hri_sim.people.person import SimulatedPerson
from hri_sim.readability.observer import Decision, Observer
from hri_sim.readability.traits import Traits
from hri_sim.scenario.schema import PersonSpec

FloatArray = NDArray[np.float64]

SEAT = (1.08, 0.05, 0.42)
"""Shoulder of who sits across the table [m]."""
HOME = (0.93, 0.27, 0.05)
"""Where the hand rests [m]."""
USUAL_S, PER_METRE_S = 0.45, 0.6
"""Duration of a reach: without any way, and what each metre adds [s]."""


def participant_spec(name: str = "person1") -> PersonSpec:
    """Who takes part."""
    return PersonSpec(id=name, shoulder=SEAT, home=HOME)


class Participant:
    """Takes part in one trial after the other; times are those of the trials' clock [s].

    Args:
        traits: How the person reads motions.
        targets: Where the hand goes for each goal (3,) [m], by name, in the order of the goals.
        hand: Whether the person reaches; else a key is pressed and the arm rests.
        rng: Draws what differs from trial to trial.
        spec: Who it is.

    Attributes:
        person: The arm.
        decision: Of the present trial.
    """

    def __init__(
        self,
        traits: Traits,
        targets: Mapping[str, FloatArray],
        *,
        hand: bool,
        rng: np.random.Generator,
        spec: PersonSpec | None = None,
    ) -> None:
        self.traits, self._hand, self._rng = traits, hand, rng
        self._targets = {name: np.array(place, dtype=float) for name, place in targets.items()}
        spec = spec or participant_spec()
        self.spec = spec.model_copy(update={"speed_factor": traits.hand_speed})
        self.person = SimulatedPerson(self.spec, 0)
        for name, place in self._targets.items():
            if hand and not self.spec.arm.can_reach(place):
                raise PlanningError(
                    f"the target of {name} is out of the reach of {self.spec.id}",
                    expected=f"{self.spec.arm.reach[1]:.2f} m from the shoulder {self.spec.shoulder}",
                )
        self._observer: Observer | None = None
        self._reached = False

    def begin(self, time_s: float, start: FloatArray, goals: Mapping[str, FloatArray]) -> None:
        """A trial begins [s]: the tool is at its start (3,) and may go to any of the goals (3,) [m]."""
        self.person.forget_ended(time_s)
        places = np.array([goals[name] for name in self._targets])
        self._observer = Observer(self.traits, start, places, self._rng)
        self._reached = False

    @property
    def decision(self) -> Decision | None:
        """What the person thinks of the present trial; none so far, or no trial is on."""
        return None if self._observer is None else self._observer.decision

    @property
    def guess(self) -> str:
        """Name of the goal that the person takes it for; empty so far."""
        decision = self.decision
        return "" if decision is None else list(self._targets)[decision.goal]

    def watch(self, time_s: float, tool: FloatArray) -> None:
        """See the tool (3,) [m] at a time [s]; once sure, the hand is going to move."""
        if self._observer is None:
            return
        decision = self._observer.watch(time_s, tool)
        if decision is not None and self._hand and not self._reached:
            self._reached = True
            self._reach(self._targets[self.guess], max(decision.shown_s, self.person.rests_from_s))

    def go_home(self, time_s: float) -> None:
        """The trial is over: put the hand back, as soon as it has arrived."""
        self._observer = None
        home = np.array(self.spec.home)
        last = self.person.motions[-1].end if self.person.motions else home
        if float(np.linalg.norm(last - home)) > 0.03:
            self._reach(home, max(time_s, self.person.rests_from_s))

    def _reach(self, target: FloatArray, start_s: float) -> None:
        last = self.person.motions[-1].end if self.person.motions else np.array(self.spec.home)
        way = float(np.linalg.norm(target - last))
        self.person.plan_reach(target, start_s, USUAL_S + PER_METRE_S * way, self._rng)
