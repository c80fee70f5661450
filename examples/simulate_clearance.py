"""Move the simulated robot past a simulated person and measure how close they come.

Uses the MuJoCo cell, its trajectory controller and the simulated person directly: no ROS, no
planner. The robot makes its nominal motion; contacts are off, so that overlap can be measured.

    scripts/_run_in_env python examples/simulate_clearance.py
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from hri_planner.robot import load_robot
from hri_prediction.errors import HriError
from hri_sim.people.person import SimulatedPerson
from hri_sim.scenario.nominal import nominal_motion
from hri_sim.scenario.shipped import load_shipped, shipped_names
from hri_sim.simulator import JointTrajectory, Simulation


def main() -> None:
    """Run the first reach of a shipped scenario."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="table_reach", choices=shipped_names())
    parser.add_argument("--seed", type=int, default=0, help="seed of the person's variability")
    parser.add_argument("--plot", metavar="PNG", help="draw the clearance over time")
    options = parser.parse_args()

    scenario = load_shipped(options.scenario)
    reach = scenario.reaches[0]
    robot = load_robot()
    simulation = Simulation(scenario, contacts=False)
    simulation.warm_up()  # compile before anything is timed

    spec = scenario.person_of(0)
    person = SimulatedPerson(spec, options.seed)
    motion = person.plan_reach(
        scenario.targets[reach.person_target], reach.person_delay, reach.person_duration
    )

    # The robot's nominal motion as a controller receives it: positions, and velocities by
    # difference; the stamp 0 means "begin when it arrives".
    goal = scenario.targets[reach.robot_target]
    times, q = nominal_motion(robot, simulation.q, goal, reach.duration)
    qd = np.gradient(q, times, axis=0)
    qd[[0, -1]] = 0.0
    simulation.controller.accept(
        JointTrajectory(0, robot.joint_names, times[1:], q[1:], velocities=qd[1:])
    )

    rows = []
    begin = time.perf_counter()
    while simulation.time_s < 2.5:
        simulation.set_arm(spec.id, person.truth(simulation.time_s))
        simulation.step(4)  # 4 ms
        nearest = simulation.clearance()
        rows.append((simulation.time_s, nearest.distance, nearest.robot_part, nearest.limb))
    took = time.perf_counter() - begin

    closest = min(rows, key=lambda row: row[1])
    error = np.linalg.norm(simulation.tool_position() - np.array(goal))
    print(f"scenario {scenario.name}: robot to {goal}, person's hand to {reach.person_target}")
    print(f"person moves from {motion.start_s:.2f} s to {motion.end_s:.2f} s")
    print(
        f"closest at {closest[0]:.2f} s: {closest[1] * 1e2:.1f} cm between the robot's "
        f"{closest[2]} and the person's {closest[3]}"
        + ("  (they overlap)" if closest[1] < 0 else "")
    )
    print(f"tool {error * 1e3:.2f} mm from the goal at the end")
    speed = simulation.time_s / took
    print(f"simulated {simulation.time_s:.1f} s in {took:.2f} s: {speed:.0f} x real time")

    if options.plot:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 3.5), layout="constrained")
        axis = figure.subplots()
        axis.plot([row[0] for row in rows], [row[1] * 1e2 for row in rows])
        axis.axhline(0.0, color="k", lw=0.8)
        axis.set_xlabel("time [s]")
        axis.set_ylabel("clearance [cm]")
        figure.savefig(options.plot, dpi=110, format="png")
        print(f"drawn: {options.plot}")


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"simulate_clearance.py: {error}")
