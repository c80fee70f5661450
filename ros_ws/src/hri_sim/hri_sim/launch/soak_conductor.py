"""Conducts a soak: one reach after the other until the time is over, with faults among them."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from hri_prediction.ros.messages import HumanPrediction, PlannerStatus, PolicyStatus
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import to_ns
from hri_sim.launch.conductor import REST_S, Conductor
from hri_sim.launch.deaths import RESTART, Deaths, ended
from hri_sim.launch.reports import INTERRUPTED, OUTCOMES
from hri_sim.launch.soak_faults import Happening, Injector
from hri_sim.launch.supervisor import Supervisor
from hri_sim.launch.withdrawing import PERSON
from hri_sim.scenario.schema import ReachSpec, Scenario
from hri_sim.soak.faults import CANCEL, PREEMPT, Fault, FaultPlan
from hri_sim.soak.latency import LatencyMatch
from hri_sim.soak.log import DEATH, FAULT, REACH, SAMPLE, TOLD, SoakLog
from hri_sim.soak.rest import REST_SPEED
from hri_sim.soak.sampler import Sampler
from hri_sim.soak.ways import Walk

SAMPLE_S = 1.0
"""Time between two samples [s]."""
OUT_OF_REACH = (2.5, 0.0, 0.5)
"""A place that the robot cannot get to [m]."""
QUIET_END_S = 20.0
"""No fault comes in the last seconds: there must be time to see what comes of the one before [s]."""
KILLS_SHARE = 0.5
"""Nodes are killed in this first share of the time alone, so that processes get old in the rest of it."""
MOST_STARTS = 1_000
"""So often a node is started again: a soak kills them itself."""
SCRIPT = "script"
"""Name of the script's own process."""
FIGURES = ("tick_hz", "dropped", "lost_in_transport")
"""What is noted of each node's health."""


class SoakConductor(Conductor):
    """Goes on for some time, whatever happens.

    Args:
        scenario: One of :func:`hri_sim.soak.ways.soak_scenario`.
        supervisor: Whose nodes.
        say: Takes the one-line live status.
        tell: Takes what must not be missed.
        log: Gets what happens.
        sampler: Looks at processes and files.
        seconds: For how long it goes on [s].
        seed: Of goals and faults.
        kinds: Faults that may come.
        labels: Names of the nodes that may be killed and paused.
        mean_wait_s: Mean time between faults [s].
    """

    def __init__(
        self,
        scenario: Scenario,
        supervisor: Supervisor,
        say: Callable[[str], None],
        tell: Callable[[str], None],
        *,
        log: SoakLog,
        sampler: Sampler,
        seconds: float,
        seed: int,
        kinds: tuple[str, ...],
        labels: tuple[str, ...],
        mean_wait_s: float,
    ) -> None:
        self._log, self._sampler, self._seconds = log, sampler, seconds
        self._begin_s = time.monotonic()

        def told(text: str) -> None:
            now_s = self._now_s()
            log.write(TOLD, {"s": now_s, "text": text})
            self._injector.told(text, now_s)
            tell(text)

        super().__init__(scenario, supervisor, say, told)
        self._deaths = Deaths(supervisor, told, RESTART, MOST_STARTS)
        goals, faults = np.random.SeedSequence(seed).spawn(2)
        self._walk = Walk(scenario, np.random.default_rng(goals))
        person = scenario.persons[0]
        self._injector = Injector(
            self._node,
            person,
            supervisor,
            FaultPlan(np.random.default_rng(faults), kinds, labels, mean_wait_s),
            self._note_fault,
            kills_until_s=KILLS_SHARE * seconds,
            until_s=seconds - QUIET_END_S,
        )
        self._latency = LatencyMatch(1e3 * person.latency)
        self._pids: dict[str, int] = {}
        self._figures: dict[str, dict[str, float]] = {}
        self._order: Fault | None = None
        self._speed = 0.0
        self._next_sample_s = 0.0
        self._number = self.not_finite = 0
        self._node.poll_topic(JointState, "joint_states", self._on_joints, SENSOR)
        self._node.create_subscription(
            JointTrajectory,
            "joint_trajectory_controller/joint_trajectory",
            self._on_trajectory,
            reliable(10),
        )
        self._node.create_subscription(
            HumanPrediction,
            f"humans/bodies/{person.id}/prediction",
            self._on_prediction,
            reliable(10),
        )

    def _now_s(self) -> float:
        return round(time.monotonic() - self._begin_s, 3)

    # ------------------------------------------------------------------ listening
    def _on_joints(self, message: JointState) -> None:
        self._speed = max((abs(speed) for speed in message.velocity), default=0.0)
        self._injector.joints(to_ns(message.header.stamp), self._speed)

    def _on_status(self, message: PlannerStatus | PolicyStatus) -> None:
        super()._on_status(message)
        self._latency.planned(to_ns(message.handover), to_ns(message.newest_sample))

    def _on_trajectory(self, message: JointTrajectory) -> None:
        self._latency.trajectory(to_ns(message.header.stamp), self.now_ns())
        values = [*(p.positions for p in message.points), *(p.velocities for p in message.points)]
        self._check_finite(np.concatenate(values) if values else np.zeros(0))

    def _on_prediction(self, message: HumanPrediction) -> None:
        self._check_finite(np.concatenate((message.mean, message.covariance)))

    def _check_finite(self, values: np.ndarray) -> None:
        self.not_finite += not np.isfinite(values).all()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        super()._on_diagnostics(message)
        for status in message.status:
            found = {item.key: item.value for item in status.values}
            self._figures[status.hardware_id] = {
                name: float(found[name]) for name in FIGURES if name in found
            }

    # ------------------------------------------------------------------ every turn
    def _look(self) -> None:
        super()._look()
        pids = self._supervisor.pids
        if not self._begun:
            self._pids = pids
            return
        now_s = self._now_s()
        for label in ended(self._pids, pids):
            wanted = self._injector.died(label)
            self._log.write(DEATH, {"s": now_s, "node": label, "wanted": wanted})
            if label == PERSON:  # whose people begin anew when it is started again
                self._walk.home()
        self._pids = pids
        if now_s >= self._next_sample_s:
            self._next_sample_s = now_s + SAMPLE_S
            self._sample(now_s)
        under_way = self._goal is not None
        fault = self._injector.turn(
            now_s,
            self.now_ns(),
            time.monotonic() - self._accepted_s if under_way else None,
            moving=self._speed >= REST_SPEED,
            well=not self._deaths.again,
        )
        if fault is not None:
            self._order = fault

    def _sample(self, now_s: float) -> None:
        sample = self._sampler.take({**self._pids, SCRIPT: os.getpid()})
        self._log.write(
            SAMPLE,
            {
                "s": now_s,
                **sample,
                "latency_ms": [round(value, 2) for value in self._latency.take()],
                "figures": self._figures,
            },
        )

    def _note_fault(self, happening: Happening) -> None:
        self._log.write(FAULT, happening.to_mapping())

    # ------------------------------------------------------------------ acting
    def run(self) -> None:
        """Go on until the time is over."""
        self._begin_s, self._next_sample_s = time.monotonic(), 0.0
        self._begun = True
        self._injector.begin(0.0)
        try:
            while self._now_s() < self._seconds:
                self.rest(REST_S)
                self._wait_for_the_dead()
                self._one_reach(self._walk.next())
            self._wait_for_the_dead()
            self.rest(REST_S)
        finally:
            self._injector.end(self._now_s())

    def _wait_for_the_dead(self) -> None:
        waited = bool(self._deaths.again)
        super()._wait_for_the_dead()
        if waited:
            self._injector.ready(self._now_s())

    def _one_reach(self, reach: ReachSpec) -> None:
        self._number += 1
        self._closest.clear()  # nobody asks for it, and a long run has many
        disturbed = self._injector.happening is not None
        begin_ns = self._cue(self._number, reach)
        outcome, reason = self._go_to(reach)
        disturbed = disturbed or self._injector.happening is not None
        now_s = self._now_s()
        self._log.write(
            REACH,
            {
                "s": now_s,
                "way": f"{reach.person_target} {reach.robot_target}",
                "outcome": outcome,
                "reason": reason,
                "seconds": round((self.now_ns() - begin_ns) * 1e-9, 2),
                "disturbed": disturbed,
            },
        )
        self._wait_for_the_person()

    def _take_back(self) -> bool:
        begins = super()._take_back()
        if begins:
            self._walk.back()
        return begins

    def _go_to(self, reach: ReachSpec) -> tuple[str, str]:
        """Send the robot to where a reach ends; how that ended, and why."""
        title = f"{self._now_s() / 60.0:.1f} of {self._seconds / 60.0:.1f} min"
        futures: deque[Any] = deque()
        ended: list[tuple[str, str]] = []
        asked: Fault | None = None

        def send(target: str, place: tuple[float, float, float], duration_s: float) -> bool:
            future = self._send(target, place, duration_s)
            if future is not None:
                futures.append(future)
            return future is not None

        def step() -> bool:
            self._say_status(title, float("inf"))
            return (
                all(future.done() for future in futures)
                or self._mover in self._deaths.again
                or self._order is not None
            )

        alive = send(reach.robot_target, self._scenario.targets[reach.robot_target], reach.duration)
        while alive:
            self.spin_until(step, 60.0, f"the result of {self._action}")
            if self._mover in self._deaths.again:
                alive = False
            elif self._order is not None and not all(future.done() for future in futures):
                asked, self._order = self._order, None
                if asked.kind == CANCEL:
                    self._goal.cancel_goal_async()
                elif asked.kind == PREEMPT:
                    other = self._walk.other(reach).robot_target
                    alive = send(other, self._scenario.targets[other], reach.duration)
                else:
                    alive = send("", OUT_OF_REACH, reach.duration)
            else:
                break
        self._goal = None
        if not alive:
            ended = [(INTERRUPTED, f"{self._mover} died")]
        for future in futures:
            if future.done():
                result = self._result_of(future, reach.robot_target)
                ended.append((OUTCOMES.get(result.outcome, "failed"), result.reason))
        outcomes = [outcome for outcome, _ in ended]
        if asked is not None:
            self._injector.goals_ended(*outcomes)
        elif self._order is None:  # else it came when the goal was over, and is for the next one
            self._injector.reach_over(outcomes[0], self._now_s())
        return " then ".join(outcomes), "; ".join(reason for _, reason in ended)
