"""Compiles every kernel once, so that no node has to do so while it runs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

import numpy as np

from hri_planner.warm import PARTS as PLANNER_PARTS
from hri_prediction.compiled import has_cache
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


PARTS: tuple[tuple[Callable[[], None], ...], ...] = (
    (warm_prediction_kernels, warm_watch, *PLANNER_PARTS[:1]),
    (*PLANNER_PARTS[1:], warm_simulation),
)
"""All that there is to be compiled, in halves that take as long."""


def warm_half(number: int) -> None:
    """Compile one of the halves, 0 or 1."""
    for warm in PARTS[number]:
        warm()


def warm_kernels() -> None:
    """Compile the kernels of all packages."""
    for number in range(len(PARTS)):
        warm_half(number)


def fill_cache() -> None:
    """Compile the kernels of all packages into the cache: an empty one by two processes, side by side.

    A compiler uses one core. What keeps such a process from its end is met again, and said, by this one.
    """
    if not has_cache():
        # They end with this process, however it ends.
        code = f"from hri_sim.launch.supervisor import die_with; die_with({os.getpid()}); "
        code += "from hri_sim.warm import warm_half; "
        running = []
        try:
            for number in range(len(PARTS)):
                command = [sys.executable, "-c", f"{code}warm_half({number})"]
                running.append(subprocess.Popen(command, stderr=subprocess.DEVNULL))
            for process in running:
                process.wait()
        finally:
            for process in running:
                process.kill()
                process.wait()
    warm_kernels()
