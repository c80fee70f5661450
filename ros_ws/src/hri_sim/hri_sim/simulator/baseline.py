"""The run that would have been without replanning: nominal motions among the same moving people."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from hri_planner.robot.model import RobotModel, load_robot
from hri_prediction.errors import DataError
from hri_sim.scenario.nominal import nominal_motion
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.simulation import STEP_NS, Simulation
from hri_sim.simulator.trajectory import JointTrajectory

FloatArray = NDArray[np.float64]
Truth = Callable[[float], FloatArray]
"""Time [s] to keypoints (4, 3) [m]: where an arm truly is."""

SAMPLE_STEPS = 4
"""Physics steps between two samples of the result: 250 Hz."""


@dataclass(frozen=True)
class JointMotion:
    """One motion of the robot.

    Attributes:
        start_s: When it begins [s].
        time_s: Times from there (N,) [s], increasing from 0.
        q: Joint angles (N, 7) [rad]; at rest at both ends.
    """

    start_s: float
    time_s: FloatArray
    q: FloatArray

    @property
    def end_s(self) -> float:
        """When it ends [s]."""
        return self.start_s + float(self.time_s[-1])


@dataclass(frozen=True)
class BaselineResult:
    """What happened, at 250 Hz.

    Attributes:
        time_s: (M,) [s], on the clock of the motions.
        clearance_m: Smallest signed surface distance robot-people (M,) [m]; infinite without
            people.
        q: Joint angles (M, 7) [rad].
    """

    time_s: FloatArray
    clearance_m: FloatArray
    q: FloatArray

    @property
    def smallest(self) -> float:
        """Smallest clearance of the run [m]."""
        return float(self.clearance_m.min())


def run_motion(
    scenario: Scenario,
    motions: Sequence[JointMotion],
    person_truth: Mapping[str, Truth],
    *,
    contacts: bool = False,
    hold_s: float = 0.6,
    robot: RobotModel | None = None,
) -> BaselineResult:
    """Execute given motions in the simulation while people move as they truly did.

    Args:
        scenario: The scene; the robot starts where the first motion does.
        motions: In order, not overlapping.
        person_truth: Every true arm that is there, by its name: see :attr:`.Scenario.arms`.
        contacts: Whether bodies push each other; without, clearances get as negative as they may.
        hold_s: How long to stay at the end of the last motion [s].
        robot: The robot; the one that ships when not given.

    Raises:
        DataError: when there is no motion, motions overlap, or the controller refuses one.
    """
    if not motions:
        raise DataError("no motion to run", expected="at least one")
    for earlier, later in pairwise(motions):
        if later.start_s < earlier.end_s:
            raise DataError(
                f"a motion starts at {later.start_s:.3f} s, before the last one ends at "
                f"{earlier.end_s:.3f} s",
                expected="motions that follow each other",
            )
    simulation = Simulation(scenario, contacts=contacts, robot=robot)
    simulation.reset(q=motions[0].q[0])
    origin = motions[0].start_s - 0.1  # a moment of rest, so that no motion is late
    steps = round((motions[-1].end_s + hold_s - origin) * 1e9 / STEP_NS)
    waiting = [_trajectory(motion, origin, simulation.robot) for motion in motions]
    count = steps // SAMPLE_STEPS + 1
    time_s, clearance, q = np.empty(count), np.empty(count), np.empty((count, 7))
    for sample in range(count):
        now = origin + simulation.time_s
        for name, truth in person_truth.items():
            simulation.set_arm(name, truth(now))
        time_s[sample], q[sample] = now, simulation.q
        clearance[sample] = simulation.clearance().distance
        if waiting and waiting[0].stamp_ns <= simulation.time_ns + SAMPLE_STEPS * STEP_NS:
            simulation.controller.accept(waiting.pop(0))
        simulation.step(SAMPLE_STEPS)
    return BaselineResult(time_s, clearance, q)


def run_baseline(
    scenario: Scenario,
    person_truth: Truth | Mapping[str, Truth],
    reach_starts: Sequence[float],
    *,
    hold_s: float = 0.6,
) -> BaselineResult:
    """All reaches of a scenario by nominal minimum-jerk motions, through whoever is in the way.

    Args:
        scenario: The scene and its reaches.
        person_truth: True arm over time: of the first person, or all by their names in the scene.
        reach_starts: When the robot sets off for each reach [s]; may stop short of all reaches.
        hold_s: How long to stay at the end [s].

    Raises:
        DataError: on more starts than reaches, or starts before the last motion's end.
        PlanningError: when a target is out of reach.
    """
    if len(reach_starts) > len(scenario.reaches):
        raise DataError(
            f"{len(reach_starts)} starts", expected=f"at most {len(scenario.reaches)}, one a reach"
        )
    robot = load_robot()
    posture = np.array(scenario.robot_start)
    motions = []
    for start, reach in zip(reach_starts, scenario.reaches, strict=False):
        goal = scenario.targets[reach.robot_target]
        time_s, q = nominal_motion(robot, posture, goal, reach.duration)
        motions.append(JointMotion(float(start), time_s, q))
        posture = q[-1]
    if not isinstance(person_truth, Mapping):
        person_truth = {scenario.persons[0].id: person_truth} if scenario.persons else {}
    return run_motion(scenario, motions, person_truth, hold_s=hold_s, robot=robot)


def _trajectory(motion: JointMotion, origin: float, robot: RobotModel) -> JointTrajectory:
    """A motion as a trajectory whose derivatives come from a clamped cubic spline."""
    spline = CubicSpline(motion.time_s, motion.q, bc_type="clamped")
    return JointTrajectory(
        round((motion.start_s - origin) * 1e9),
        robot.joint_names,
        motion.time_s,
        motion.q,
        spline(motion.time_s, 1),
        spline(motion.time_s, 2),
    )
