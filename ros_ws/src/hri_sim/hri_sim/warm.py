"""Compiles every kernel once, so that no node has to do so while it runs."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

from hri_planner.warm import PRECISIONS, warm_policies, warm_ptomp, warm_separation
from hri_prediction.ontology.warm import warm_watch
from hri_prediction.warm import warm_kernels as warm_prediction_kernels
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.nominal import nominal_motion
from hri_sim.simulator.simulation import Simulation
from hri_sim.simulator.trajectory import JointTrajectory


def warm_simulation() -> None:
    """Run every kernel of the simulator: a short motion past an arm, replaced once."""
    scenario = draw_scenario(0, 1)
    simulation = Simulation(scenario)
    robot = simulation.robot
    body_id = scenario.persons[0].id
    simulation.set_arm(
        body_id, scenario.persons[0].arm.posture(np.array(scenario.persons[0].home), 0.2)
    )
    goal = np.array(scenario.targets[scenario.reaches[0].robot_target])
    time_s, q = nominal_motion(robot, np.array(scenario.robot_start), goal, 1.5, 25.0)
    zeros = np.zeros_like(q)
    for velocities, accelerations in ((None, None), (zeros, None), (zeros, zeros)):
        simulation.controller.accept(
            JointTrajectory(0, robot.joint_names, time_s + 0.05, q, velocities, accelerations)
        )
        simulation.step(30)
        simulation.clearance()
        simulation.table_clearance()


def warm_first_half() -> None:
    """Compile what takes half of the time: what has to do with people, and the planner that is usual."""
    warm_prediction_kernels()
    warm_watch()
    warm_ptomp(PRECISIONS[0])


def warm_second_half() -> None:
    """Compile the rest: the planner in the other precision, policies, monitor, simulator."""
    for precision in PRECISIONS[1:]:
        warm_ptomp(precision)
    warm_policies()
    warm_separation()
    warm_simulation()


def warm_kernels() -> None:
    """Compile the kernels of all packages."""
    warm_first_half()
    warm_second_half()


def warm_kernels_side_by_side() -> None:
    """Compile them into an empty cache in two processes, as a compiler uses one core.

    Raises:
        subprocess.CalledProcessError: when they cannot be compiled.
    """
    code = "import hri_sim.warm as w; w.{}()"
    halves = (warm_first_half, warm_second_half)
    commands = [[sys.executable, "-c", code.format(half.__name__)] for half in halves]
    running = [subprocess.Popen(command) for command in commands]
    try:
        codes = [process.wait() for process in running]
    except BaseException:
        for process in running:
            process.kill()
            process.wait()
        raise
    for command, exit_code in zip(commands, codes, strict=True):
        if exit_code:
            raise subprocess.CalledProcessError(exit_code, command)
    # Of a kernel that both have compiled, with other types, one may have replaced the other's entry.
    warm_kernels()
