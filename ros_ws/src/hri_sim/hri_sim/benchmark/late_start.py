"""How late planners set off on a slow machine, and whether conditions are still a test by then."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.budget import START_S, VirtualTimeBudget, replan_charge
from hri_planner.robot import load_robot
from hri_prediction.arm.geometry import ArmRadii
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.planners import PlannerSetup
from hri_sim.scenario.conditions import ROBOT_DURATION_S
from hri_sim.scenario.examination import clearance_series, robot_part


def start_delay(setup: PlannerSetup, slowdown: float) -> float:
    """When the robot sets off: as soon as a first replan is paid for [s].

    Args:
        setup: The planner; its time steps and roll-outs are those of its settings.
        slowdown: F.
    """
    if setup.observer is None:
        return 0.0
    config, budget = setup.config, VirtualTimeBudget(slowdown)
    interval_s = ROBOT_DURATION_S / config.num_timesteps
    given_s = interval_s if config.interleaved else ROBOT_DURATION_S  # once for a whole motion
    charge_s = replan_charge(setup.config) + START_S
    intervals = 0
    while budget.grant(given_s, config.num_rollouts, config.num_timesteps, charge_s) is None:
        given_s = interval_s
        intervals += 1
    return intervals * interval_s


def still_collides(condition: Condition, delay_s: float) -> bool:
    """Whether the nominal motion, begun so late, meets the person before it is at its goal."""
    robot, scenario = load_robot(), condition.scenario
    start = np.array(scenario.robot_start)
    part = robot_part(robot, start, condition.robot_goal, ROBOT_DURATION_S, scenario.table)
    moving = slice(0, part.arrived + 1)
    waiting = np.arange(0.0, delay_s - 1e-9, part.time[1])
    times = np.concatenate((waiting, delay_s + part.time[moving]))
    q = np.concatenate((np.repeat(start[None], len(waiting), axis=0), part.q[moving]))
    arm = condition.person().truth(times)
    radii = robot.capsule_radii
    distance = clearance_series(q, robot.lengths, radii, arm, ArmRadii().array)
    return bool(distance.min() <= 0.0)
