"""Person node: the simulated people of a scenario, their truth and what motion capture makes of it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, HriError
from hri_prediction.ros.conversions import WORLD, message_from_sample
from hri_prediction.ros.messages import Cue, HumanArm, IdsList, Reset
from hri_prediction.ros.node import OK, CountedPublisher, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_prediction.tracks.track import ArmSample
from hri_sim.nodes.simulator_node import read_scenario
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.seeding import reach_generator, tracking_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel
from hri_sim.scenario.schema import PersonSpec, Scenario

TRUTH_LEAD_NS = 2 * SAMPLE_PERIOD_NS
"""The truth is said this much ahead [ns], so that the simulator has it when its clock gets there."""
MAX_CUE_S = 600.0
"""Longer delays or durations in a cue are taken for mistakes [s]."""
MAX_CATCH_UP = 50
"""Captures that a late tick makes up for; older ones are skipped, and a fault is noted."""


@dataclass(frozen=True)
class PersonNodeConfig:
    """What the node needs to know."""

    scenario: str = parameter("", "Path of the scenario file; empty: the table scene that ships")
    seed: int = parameter(0, "Seed of the people's variability and of the tracking", low=0)

    def __post_init__(self) -> None:
        validate(self)


class _Body:
    """One person: truth, tracking, samples on their way."""

    def __init__(self, spec: PersonSpec, seed: int) -> None:
        self.spec = spec
        self.person = SimulatedPerson(spec, seed)
        self.tracking = TrackingModel(spec, tracking_generator(seed, spec.id))
        self.pending: deque[tuple[int, ArmSample]] = deque()
        self.ahead: dict[int, NDArray[np.float64]] = {}


class PersonNode(HriNode):
    """Moves the people of a scenario on cue."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("person", period_s=SAMPLE_PERIOD_NS / NANO, **kwargs)
        config = declare_config(self, PersonNodeConfig)
        self._scenario: Scenario = read_scenario(config.scenario)
        if not self._scenario.persons:
            raise ConfigError(
                f"scenario {self._scenario.name!r} has no persons", expected="at least one"
            )
        self._seed = config.seed
        self._skipped = 0
        self._truth: dict[str, CountedPublisher] = {}
        self._tracked: dict[str, CountedPublisher] = {}
        for spec in self._scenario.persons:
            self._truth[spec.id] = self.announce(HumanArm, f"sim/bodies/{spec.id}/arm", SENSOR)
            self._tracked[spec.id] = self.announce(HumanArm, f"humans/bodies/{spec.id}/arm", SENSOR)
        self._ids = self.announce(IdsList, "humans/bodies/tracked", LATCHED)
        self.listen(Cue, "sim/cue", self._on_cue, reliable(10))
        self.serve(Reset, "~/reset", self._on_reset)
        self._begun = False
        self._restart()
        self._say_ids()

    def _restart(self) -> None:
        self._bodies = {spec.id: _Body(spec, self._seed) for spec in self._scenario.persons}
        # Floats hold times from the first capture, not from 1970: they keep their precision.
        now = self.now_ns()
        self._origin_ns = now // SAMPLE_PERIOD_NS * SAMPLE_PERIOD_NS
        self._next_truth_ns = self._next_capture_ns = self._origin_ns + SAMPLE_PERIOD_NS
        self._last_ns = now

    def _say_ids(self) -> None:
        header = Header(stamp=to_time(self.now_ns()), frame_id=WORLD)
        self._ids.publish(IdsList(header=header, ids=list(self._bodies)))

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - self._origin_ns) / NANO

    def _on_cue(self, cue: Cue) -> None:
        if not cue.person_target:
            return
        if not all(math.isfinite(t) and 0.0 <= t <= MAX_CUE_S for t in (cue.delay, cue.duration)):
            text = f"cue with a delay of {cue.delay} s and a duration of {cue.duration} s ignored"
            self.fault("cue", text)
            return
        target = self._scenario.targets.get(cue.person_target)
        if target is None:
            known = ", ".join(self._scenario.targets)
            self.fault("cue", f"cue names target {cue.person_target!r}; known are {known}")
            return
        index = cue.reach if 0 <= cue.reach < len(self._scenario.reaches) else 0
        body = self._bodies[self._scenario.person_of(index).id]
        try:
            body.person.plan_reach(
                target,
                self._seconds(to_ns(cue.header.stamp)) + cue.delay,
                cue.duration,
                reach_generator(self._seed, body.spec.id, cue.reach),
            )
        except HriError as error:
            self.fault("cue", str(error))

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        try:
            if request.scenario:
                scenario = read_scenario(request.scenario)
                if {spec.id for spec in scenario.persons} != set(self._bodies):
                    raise ConfigError(
                        f"{request.scenario} has other persons than this graph",
                        expected=", ".join(self._bodies),
                        hint="start the node with that scenario",
                    )
                self._scenario = scenario
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        self._seed = int(request.seed)
        self._restart()
        response.success = True
        return response

    def on_tick(self, now_ns: int) -> None:
        """Say the truth, capture it, and deliver what the tracking latency has let through."""
        if not self._begun:
            self._begun = True
            self._restart()
        if now_ns < self._last_ns - NANO:
            self.fault("clock", "the clock went back: the people start again")
            self._restart()
        self._last_ns = max(self._last_ns, now_ns)
        behind = (now_ns - self._next_capture_ns) // SAMPLE_PERIOD_NS
        if behind > MAX_CATCH_UP:
            self._skipped += behind
            for body in self._bodies.values():
                body.ahead.clear()
            self.fault("late", f"{behind} captures skipped: this node was held up")
            self._next_capture_ns += behind * SAMPLE_PERIOD_NS
            self._next_truth_ns = max(self._next_truth_ns, self._next_capture_ns)
        while self._next_truth_ns <= now_ns + TRUTH_LEAD_NS:
            self._say_truth(self._next_truth_ns)
            self._next_truth_ns += SAMPLE_PERIOD_NS
        while self._next_capture_ns <= now_ns:
            self._capture(self._next_capture_ns)
            self._next_capture_ns += SAMPLE_PERIOD_NS
        for body_id, body in self._bodies.items():
            while body.pending and body.pending[0][0] <= now_ns:
                sample = body.pending.popleft()[1]
                self._tracked[body_id].publish(message_from_sample(sample, body_id))

    def _say_truth(self, stamp_ns: int) -> None:
        for body_id, body in self._bodies.items():
            keypoints = body.person.truth(self._seconds(stamp_ns))
            body.ahead[stamp_ns] = keypoints
            sample = ArmSample(stamp_ns, keypoints, np.ones(4, dtype=bool), body.spec.side)
            self._truth[body_id].publish(message_from_sample(sample, body_id))

    def _capture(self, stamp_ns: int) -> None:
        for body in self._bodies.values():
            # Said a moment ago as the truth; computed anew only where captures were skipped.
            keypoints = body.ahead.pop(stamp_ns, None)
            if keypoints is None:
                keypoints = body.person.truth(self._seconds(stamp_ns))
            tracked = body.tracking.observe(stamp_ns, keypoints)
            body.pending.append((tracked.delivery_ns, tracked.sample))

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Who is there and what they do."""
        now = self._seconds(self.now_ns())
        moving = [i for i, body in self._bodies.items() if now < body.person.rests_from_s]
        figures = {"bodies": ", ".join(self._bodies), "captures_skipped": self._skipped}
        return OK, f"reaching: {', '.join(moving)}" if moving else "at rest", figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(PersonNode, args)
