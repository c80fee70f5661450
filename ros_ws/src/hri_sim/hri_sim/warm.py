"""Compiles every kernel once, so that no node has to do so while it runs."""

from __future__ import annotations

import numpy as np

from hri_planner.warm import warm_kernels as warm_planner_kernels
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


def warm_kernels() -> None:
    """Compile the kernels of all packages."""
    warm_prediction_kernels()
    warm_planner_kernels()
    warm_watch()
    warm_simulation()
