"""Person node: the simulated people of a scenario, their truth and what motion capture makes of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, HriError
from hri_prediction.ros.messages import Cue, Reset
from hri_prediction.ros.node import OK, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import NANO, to_ns
from hri_sim.nodes.captured_bodies import CapturedBodies
from hri_sim.people.capture import CapturedArm
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.seeding import reach_generator, tracking_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel
from hri_sim.scenario.schema import BACK, Scenario
from hri_sim.scenario.shipped import scenario_or_shipped

MAX_CUE_S = 600.0
"""Longer delays or durations in a cue are taken for mistakes [s]."""


KEPT_S = 1.0
"""Reaches that ended longer ago are not asked for any more, however late a tick comes [s]."""


@dataclass(frozen=True)
class PersonNodeConfig:
    """What the node needs to know."""

    scenario: str = parameter("", "Path of the scenario file; empty: the table scene that ships")
    seed: int = parameter(0, "Seed of the people's variability and of the tracking", low=0)

    def __post_init__(self) -> None:
        validate(self)


class PersonNode(HriNode):
    """Moves the people of a scenario on cue."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("person", period_s=SAMPLE_PERIOD_NS / NANO, **kwargs)
        config = declare_config(self, PersonNodeConfig)
        self._scenario: Scenario = scenario_or_shipped(config.scenario)
        if not self._scenario.persons:
            raise ConfigError(
                f"scenario {self._scenario.name!r} has no persons", expected="at least one"
            )
        self._seed = config.seed
        ids = [spec.id for spec in self._scenario.persons]
        self._captured = CapturedBodies(self, ids, self._people_anew)
        self.listen(Cue, "sim/cue", self._on_cue, reliable(10))
        self.serve(Reset, "~/reset", self._on_reset)

    def _people_anew(self) -> dict[str, list[CapturedArm]]:
        self._people: dict[str, SimulatedPerson] = {}
        bodies: dict[str, list[CapturedArm]] = {}
        for person in self._scenario.persons:
            name, arms = person.id, bodies.setdefault(person.id, [])
            for number, spec in enumerate(person.arms.values()):
                whole = SimulatedPerson(spec, self._seed)
                self._people.setdefault(name, whole)  # the first is the arm that reaches
                tracking = TrackingModel(spec, tracking_generator(self._seed, name, number))
                arms.append(CapturedArm(whole.truth, spec.side, tracking))
        return bodies

    def _on_cue(self, cue: Cue) -> None:
        if not cue.person_target:
            return
        if not all(math.isfinite(t) and 0.0 <= t <= MAX_CUE_S for t in (cue.delay, cue.duration)):
            text = f"cue with a delay of {cue.delay} s and a duration of {cue.duration} s ignored"
            self.fault("cue", text)
            return
        index = cue.reach if 0 <= cue.reach < len(self._scenario.reaches) else 0
        name = self._scenario.person_of(index).id
        person = self._people[name]
        back = cue.person_target == BACK
        target = person.came_from if back else self._scenario.targets.get(cue.person_target)
        if target is None:
            known = ", ".join((*self._scenario.targets, BACK))
            self.fault("cue", f"cue names target {cue.person_target!r}; known are {known}")
            return
        # The truth is worked out from all reaches that are kept: a tick must not take longer after a
        # thousand of them.
        person.forget_ended(self._captured.seconds(self.now_ns()) - KEPT_S)
        try:
            person.plan_reach(
                target,
                self._captured.seconds(to_ns(cue.header.stamp) or self.now_ns()) + cue.delay,
                cue.duration,
                reach_generator(self._seed, name, cue.reach),
            )
        except HriError as error:
            self.fault("cue", str(error))

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        try:
            if request.scenario:
                scenario = scenario_or_shipped(request.scenario)
                # An arm that was there and is no longer would be waited for by all who know of it.
                if _arms(scenario) != _arms(self._scenario):
                    raise ConfigError(
                        f"{request.scenario} has other persons, or arms, than this graph",
                        expected=", ".join(
                            f"{name} ({side})" for name, side in _arms(self._scenario)
                        ),
                        hint="start the node with that scenario",
                    )
                self._scenario = scenario
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        self._seed = int(request.seed)
        self._captured.restart()
        response.success = True
        return response

    def on_tick(self, now_ns: int) -> None:
        """Publish what the people do."""
        self._captured.tick(now_ns)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Who is there and what they do."""
        now = self._captured.seconds(self.now_ns())
        moving = [name for name, person in self._people.items() if now < person.rests_from_s]
        figures = {
            "bodies": ", ".join(self._people),
            "captures_skipped": self._captured.skipped,
            "reaches_kept": max(len(person.motions) for person in self._people.values()),
        }
        return OK, f"reaching: {', '.join(moving)}" if moving else "at rest", figures


def _arms(scenario: Scenario) -> list[tuple[str, str]]:
    """Body id and side of all arms."""
    return sorted((spec.id, spec.side) for spec in scenario.arms.values())


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(PersonNode, args)
