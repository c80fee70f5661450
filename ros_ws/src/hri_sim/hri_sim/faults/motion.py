"""A robot on its way past a person in lock-step: a fault is brought about, and what follows is measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from numpy.typing import NDArray
from rclpy.logging import LoggingSeverity

from hri_planner.robot.model import RobotModel, load_robot
from hri_prediction.closing import Closing
from hri_prediction.errors import GraphError
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.ros.messages import HumanPrediction
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import to_ns
from hri_sim.benchmark.workers import do_all
from hri_sim.faults.own_motion import REST, OwnMotion, own_motion
from hri_sim.faults.reference import BEYOND, JUMP, Asked, on_course
from hri_sim.launch.reports import OUTCOMES
from hri_sim.launch.scene import scenario_library
from hri_sim.reliability.fault import Figure, Measure, Place, Trial
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, ReachHandle, cue, policy_graph, ptomp_graph, reach
from hri_sim.testing.messages import numbers
from hri_sim.testing.spoiling import ARM, RAW, STILL

SCENES = (100, 101, 102)
"""Seeds of the scenes: robot and person cross, twice."""
ARM_RADII = np.array([0.05, 0.04, 0.05])
"""Upper arm, forearm, hand [m]."""
ARM_REACH_M = 0.29 + 0.26 + 0.09
PTOMP, POLICY = "ptomp", "policy"
REFERENCE = "/joint_trajectory_controller/reference"
PREDICTION = "/humans/bodies/person1/prediction"
STATE_S = 0.004

AT_REST = Figure("rest_ms", "robot at rest after", "ms", 200.0)
NAMED = Figure("named_ms", "named after", "ms", 1000.0)
TOUCHED = Figure("touched", "states in which a moving robot touches a person", limit=0.0)
CAME_AT = Figure("came_at", "speed at which it comes at whom it touches", "m/s", digits=2)
LEANT_ON = Figure("leant_on", "states in which a person touches a resting robot")
NOT_FINITE = Figure("not_finite", "NaN or infinity in what nodes say", limit=0.0)
WILD = Figure("wild", "predictions beyond an arm's reach", limit=0.0)
REACHED = Figure("reached", "the goal is reached in the end", limit=1.0, least=True)
AGAIN = Figure("again", "the next goal is reached", limit=1.0, least=True)
SAFE = (JUMP, BEYOND, TOUCHED, CAME_AT, LEANT_ON, NOT_FINITE)
"""What is wanted of every fault."""


def scene(seed: int, keep: Path) -> tuple[Scenario, Path]:
    """Scene of a repetition, and the library of its person's tasks."""
    number = SCENES[seed % len(SCENES)]
    scenario, path = draw_scenario(number, 2), keep / f"library_{number}.npz"
    if not path.exists():
        keep.mkdir(parents=True, exist_ok=True)
        trained = scenario_library(scenario, number)
        assert trained is not None
        # Others may do the same at the same time: whoever is last wins, with the same content.
        new = path.with_name(f"{np.random.default_rng().integers(1 << 30)}_{path.name}")
        trained.save(new)
        new.replace(path)
    return scenario, path


def arm_clearance(robot: RobotModel, q: NDArray[np.float64], arm: NDArray[np.float64]) -> float:
    """Distance of the robot to an arm (4, 3) [m]."""
    limbs = np.stack((arm[:-1], arm[1:]), axis=1)
    robot_capsules = robot.robot_capsules(q)
    return float(capsule_distances(robot_capsules, robot.capsule_radii, limbs, ARM_RADII).min())


def arm_beside(seed: int, scenario: Scenario) -> NDArray[np.float64]:
    """An arm that is held still, at a random place which the robot leaves free at first (4, 3) [m]."""
    rng, robot = np.random.default_rng(seed), load_robot()
    start = np.array(scenario.robot_start)
    while True:
        arm = STILL + rng.uniform(-0.2, 0.2, 3)
        if arm_clearance(robot, start, arm) > 0.05:
            return arm


class Motion(Closing):
    """A graph in lock-step; a context manager.

    Args:
        seed: Of the repetition: scene, people, and all that is drawn.
        place: For files.
        name: Of the fault, so that two of them draw differently.
        mover: Node that moves the robot.
        options: Of :func:`hri_sim.testing.ptomp_graph`.

    Attributes:
        rng: For what is drawn.
    """

    def __init__(
        self, seed: int, place: Place, name: str, *, mover: str = PTOMP, **options: Any
    ) -> None:
        self.seed, self.mover = seed, mover
        self.rng = np.random.default_rng([seed, *name.encode()])
        self.scenario, library = scene(seed, place.keep)
        self._level = rclpy.logging.get_logger_level("")
        rclpy.logging.set_logger_level("", LoggingSeverity.FATAL)
        folder = place.folder / str(seed)
        folder.mkdir(parents=True, exist_ok=True)
        make: Any = partial(ptomp_graph, library=library) if mover == PTOMP else policy_graph
        self.graph: Graph = make(self.scenario, folder, seed=seed, **options)
        self.said: list[tuple[int, DiagnosticStatus]] = []
        self.graph.overhear(DiagnosticArray, "/diagnostics", self._hear, reliable(100))
        self.begin_s = 0.0
        self._seen: dict[str, int] = {}

    def _hear(self, message: DiagnosticArray) -> None:
        self.said += [(to_ns(message.header.stamp), status) for status in message.status]

    def close(self) -> None:
        """End the graph."""
        self.graph.close()
        rclpy.logging.set_logger_level("", self._level)

    # ------------------------------------------------------------------ acting
    def start(self, index: int = 0) -> ReachHandle:
        """Cue the person and send the robot's goal of a reach."""
        cue(self.graph, self.scenario, index)
        return reach(self.graph, self.scenario, index, f"/{self.mover}/reach_target")

    def under_way(self, latest_s: float = 0.8) -> ReachHandle:
        """Start, and go on to a random time of the motion; another one where the robot rests by then.

        Raises:
            GraphError: when it rests each time.
        """
        self.graph.run(0.6)
        for attempt in range(6):
            handle = self.start(attempt % 2)
            self.graph.run_until(lambda: self.fastest() > 0.05, 10.0)
            self.graph.run(self.rng.uniform(0.0, latest_s))
            if self.fastest() > REST:
                return handle
            self.finish(handle)
            self.graph.run(0.5)
        raise GraphError("the robot rests whenever the fault is to begin")

    def mark(self) -> None:
        """Here the fault begins."""
        self.begin_s = self.graph.now_s
        self._seen = {topic: len(said) for topic, said in self.graph.log.items()}

    def finish(self, handle: ReachHandle, timeout_s: float = 15.0) -> str:
        """Outcome of a goal; ``nothing`` when there is none in time."""
        try:
            self.graph.run_until(lambda: handle.done, timeout_s)
        except GraphError:
            return "nothing"
        assert handle.result is not None
        return OUTCOMES.get(handle.result.outcome, "failed")

    def reaches_again(self, index: int = 1) -> float:
        """Whether the robot, given another goal, still reaches it: 1 or 0."""
        self.graph.run(0.5)
        handle = self.start(index)
        if self.finish(handle) == "reached":
            return 1.0
        # Somebody who stands where it is to go may keep it from it: they go, and it is tried again.
        self.graph.run(2.0)
        handle = self.start(1 - index)
        return float(self.finish(handle) == "reached")

    # ------------------------------------------------------------------ looking
    def fastest(self) -> float:
        """Fastest joint now [rad/s]."""
        return float(np.abs(self.graph.newest("/joint_states").velocity).max())

    def since(self, topic: str) -> list[Any]:
        """What was said on a topic since the fault began."""
        return self.graph.messages(topic)[self._seen.get(topic, 0) :]

    def rest_ms(self) -> float | None:
        """From the fault to rest [ms]: 0 when the robot was at rest; none when it moves yet."""
        found = self._own_motion()
        if found.moves:
            return None
        begin_s = self._seen["/joint_states"] * STATE_S
        if found.rest_s is None or found.rest_s < begin_s:
            return 0.0
        return (found.rest_s - begin_s + STATE_S) * 1e3

    def _own_motion(self) -> OwnMotion:
        """How the robot has moved since the graph began; states are counted, as clocks may jump."""

        def timed(topic: str, value: Callable[[Any], float]) -> list[tuple[float, float]]:
            return [(n * STATE_S, value(m)) for n, m in enumerate(self.graph.messages(topic))]

        return own_motion(
            timed("/joint_states", lambda m: float(np.abs(m.velocity).max())),
            timed(REFERENCE, lambda m: float(np.abs(m.reference_velocity).max())),
            [
                (n * STATE_S, float(m.contacts_human), m.approach)
                for n, m in enumerate(self.graph.messages("/sim/state"))
            ],
            moving=False,
        )

    def named(self, *words: str, by: str = "") -> tuple[float | None, str]:
        """When one of these words was first said [ms], and what: in a reason, or on /diagnostics.

        Args:
            words: Which.
            by: Node that is to say it there; empty: any, in reasons too.
        """
        found: list[tuple[float, str]] = []
        for topic, message_type in self.graph.lockstep.log.types.items():
            if by or not hasattr(message_type, "reason"):
                continue
            for time_ns, message in self.timed(topic):
                if any(word in message.reason for word in words):
                    found.append((time_ns * 1e-9, f"{topic}: {message.reason}"))
                    break
        for stamp_ns, status in self.said:
            if by not in ("", status.hardware_id):
                continue
            told = [status.message] if status.level != DiagnosticStatus.OK else []
            told += [v.value for v in status.values if v.key.startswith("fault ")]
            text = next((t for t in told if any(word in t for word in words)), "")
            if text and stamp_ns * 1e-9 >= self.begin_s:
                found.append((stamp_ns * 1e-9, f"/diagnostics of {status.hardware_id}: {text}"))
                break
        if not found:
            return None, ""
        when, text = min(found)
        return max(when - self.begin_s, 0.0) * 1e3, text

    def safe(self, *, afterwards: bool = False) -> dict[str, float | None]:
        """Figures of :data:`SAFE`, over the whole motion; of what is spoilt itself nothing is looked at.

        Args:
            afterwards: Whether steps of the reference count only since the fault began.
        """
        besides = {f"/{ARM}", f"/{RAW}"}
        told = self.since(REFERENCE) if afterwards else self.graph.messages(REFERENCE)
        # Clocks may jump: states are counted.
        asked = [Asked.of(message, number * STATE_S) for number, message in enumerate(told)]
        found = self._own_motion()
        return {
            **on_course(asked, load_robot()),
            "touched": float(found.touched_moving),
            "came_at": found.came_at,
            "leant_on": float(found.touched_at_rest),
            "not_finite": float(
                sum(
                    not math.isfinite(value)
                    for topic in self.graph.log.keys() - besides
                    for message in self.graph.messages(topic)
                    for _, value in numbers(message, topic)
                )
            ),
        }

    def timed(self, topic: str) -> list[tuple[int, Any]]:
        """The same with the times of the steps [ns]."""
        said = self.graph.log[topic][self._seen.get(topic, 0) :]
        return [(now_ns, m) for (now_ns, _), m in zip(said, self.since(topic), strict=True)]

    def clearance_to(self, arm: NDArray[np.float64]) -> float:
        """Smallest distance of the robot to an arm that was held still (4, 3) [m]."""
        robot, states = load_robot(), self.graph.messages("/joint_states")[::5]
        return min(arm_clearance(robot, np.array(m.position), arm) for m in states)

    def wild(self) -> float:
        """Predictions since the fault began that are beyond an arm's reach of the shoulder."""
        count = 0
        for message in self.since(PREDICTION) if PREDICTION in self.graph.log else []:
            if message.state == HumanPrediction.INVALID:
                continue
            mean = np.array(message.mean).reshape(-1, 4, 3)
            far: NDArray[np.float64] = np.linalg.norm(mean - mean[:, :1], axis=2)
            count += bool(far.max() > 1.15 * ARM_REACH_M)
        return float(count)


def _one(one: Callable[[int, Place], Trial], place: Place, seed: int) -> Trial:
    return one(seed, place)


def in_lockstep(
    one: Callable[[int, Place], Trial], seeds: Sequence[int], place: Place
) -> Iterator[Trial]:
    """Repetitions, each in a graph of its own, on as many cores as there may be."""
    if place.workers == 1 or len(seeds) == 1:
        for seed in seeds:
            yield one(seed, place)
        return
    with closing(
        do_all(partial(_one, one, replace(place, stays={})), seeds, workers=place.workers)
    ) as results:
        yield from results


def lockstep(one: Callable[[int, Place], Trial]) -> Measure:
    """How a fault is measured that is brought about in lock-step."""
    return partial(in_lockstep, one)
