"""Plan a reach around the place where a person's arm is going to be.

Calls the planner as the node does, one replan an interval, but with a forecast made by hand: an
arm that swings into the way and rests there. Prints how the plan changes.

    scripts/_run_in_env python examples/plan_around_forecast.py
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner, TableBox
from hri_planner.robot import load_robot, solve_ik
from hri_prediction.arm.geometry import ArmRadii, arm_capsules
from hri_prediction.errors import HriError
from hri_prediction.geometry import capsule_distances

INTERVAL_S = 0.036
RESTING = np.array([[0.80, 0.10, 0.40], [0.80, 0.12, 0.12], [0.62, 0.35, 0.08], [0.56, 0.40, 0.08]])
REACHED = np.array([[0.80, 0.10, 0.40], [0.70, 0.08, 0.18], [0.50, 0.02, 0.20], [0.42, 0.00, 0.20]])
RADII = ArmRadii().array


def arm_at(times_s: np.ndarray) -> np.ndarray:
    """Keypoints (n, 4, 3) [m] of an arm that reaches from 0.2 s to 1.0 s."""
    share = np.clip((times_s - 0.2) / 0.8, 0.0, 1.0)
    blend = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    return RESTING + blend[:, None, None] * (REACHED - RESTING)


def forecast_at(now_s: float) -> HumanForecast:
    """What a perfect predictor would say now: 1.5 s ahead, 1 cm sure now and 3 cm at the end."""
    offsets = np.linspace(0.0, 1.5, 31)
    sigma = np.repeat(np.linspace(0.01, 0.03, 31)[:, None], 4, axis=1)
    return HumanForecast(now_s, 0.05, arm_at(now_s + offsets), sigma, RADII)


def main() -> None:
    """Plan without a person, then replan with one, and compare the clearances."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plot", metavar="PNG", help="draw both tool paths from above")
    options = parser.parse_args()

    robot = load_robot()
    rng = np.random.default_rng(3)
    start = solve_ik(
        robot, np.array([0.42, -0.38, 0.28]), np.array([-0.7, -0.4, 0, 1.5, 0, -0.8, 0]), rng
    )
    goal = np.array([0.42, 0.38, 0.28])
    table = TableBox((0.85, 0.0, -0.03), (1.2, 1.4, 0.04))
    planner = PtompPlanner(robot, PtompConfig(), rng, table)

    def clearance(q: np.ndarray, time_s: float) -> float:
        """Surface distance robot-arm [m]: the smallest of nine pairs of capsules."""
        arm = arm_capsules(arm_at(np.array([time_s])))[0]
        capsules = robot.robot_capsules(q)
        return float(capsule_distances(capsules, robot.capsule_radii, arm, RADII).min())

    nominal = planner.start(start, np.zeros(7), goal, 1.5, 0.0)
    times = np.linspace(0.0, nominal.end_s, 200)
    blind = [clearance(nominal.sample(t)[0], t) for t in times]
    print(f"without looking: {nominal.end_s:.2f} s, smallest clearance {min(blind) * 1e2:.1f} cm")

    now, least, replans, jump, path = 0.0, np.inf, 0, 0.0, []
    while not planner.finished(now) and now < 6.0:
        old = planner.plan
        assert old is not None
        result = planner.replan(now + INTERVAL_S, [forecast_at(now)], iterations=8)
        q_new = result.plan.sample(now + INTERVAL_S)[0]
        jump = max(jump, float(np.abs(old.sample(now + INTERVAL_S)[0] - q_new).max()))
        replans += 1
        if replans % 8 == 1:
            reason = f": {result.reason}" if result.reason else ""
            print(f"  {now:4.2f} s  arrival {result.plan.end_s:4.2f} s  {result.stage}{reason}")
        for t in np.linspace(now, now + INTERVAL_S, 5):  # the robot follows the plan in force
            q = old.sample(t)[0]
            least = min(least, clearance(q, t))
            path.append(robot.frames(q)[3])
        now += INTERVAL_S
    error = np.linalg.norm(robot.frames(planner.plan.sample(now)[0])[3] - goal)
    print(
        f"with replanning: {now:.2f} s, smallest clearance {least * 1e2:.1f} cm, "
        f"{replans} replans, largest jump {jump:.0e} rad, goal error {error * 1e3:.1f} mm"
    )

    if options.plot:
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6, 6), layout="constrained")
        axis = figure.subplots()
        tool = robot.frames(nominal.sample(times)[0])[:, 3]
        axis.plot(tool[:, 0], tool[:, 1], "k--", label="without looking")
        axis.plot(*np.array(path)[:, :2].T, label="with replanning")
        for points, label in ((RESTING, "arm before"), (REACHED, "arm after")):
            axis.plot(points[:, 0], points[:, 1], "o-", label=label)
        axis.set_xlabel("x [m]")
        axis.set_ylabel("y [m]")
        axis.set_aspect("equal")
        axis.legend()
        figure.savefig(options.plot, dpi=110, format="png")
        print(f"drawn: {options.plot}")


if __name__ == "__main__":
    try:
        main()
    except (HriError, OSError) as error:
        sys.exit(f"plan_around_forecast.py: {error}")
