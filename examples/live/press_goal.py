#!/usr/bin/env python3
"""A keyboard for experiments with people: press the number of the goal that the robot is going to.

Beside `scripts/adapt_policy.py --human live`, in a terminal of its own:

    scripts/_run_in_env python examples/live/press_goal.py --experiment preliminary_end_effector --nobody
"""

from __future__ import annotations

import argparse
import os
import select
import sys
import termios
import time
import tty

import rclpy
from std_msgs.msg import Header

from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_prediction.errors import HriError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import GoalGuess, IdsList
from hri_prediction.ros.qos import LATCHED, reliable
from hri_prediction.ros.tracked import TRACKED


def main() -> int:
    """Publish a guess for each key until q."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--experiment", default="transfer", help="says what the goals are")
    parser.add_argument(
        "--nobody",
        action="store_true",
        help="say, again and again, that nobody is tracked, where nobody else does",
    )
    options = parser.parse_args()
    try:
        goals = list(load_experiment(find_experiment(options.experiment)).goals)
    except HriError as error:
        parser.error(str(error))
    if not sys.stdin.isatty():
        parser.error("stdin is no terminal: run it in one")
    rclpy.init()
    node = rclpy.create_node("press_goal")
    guesses = node.create_publisher(GoalGuess, "humans/guess", reliable(10))
    bodies = node.create_publisher(IdsList, TRACKED, LATCHED) if options.nobody else None
    print("; ".join(f"{number + 1}: {goal}" for number, goal in enumerate(goals)) + "; q: quit")
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        while True:
            if bodies is not None:  # a list that is not said again is soon too old to move by
                bodies.publish(IdsList(header=Header(frame_id=WORLD)))
            if not select.select([sys.stdin], [], [], 0.04)[0]:
                continue
            stamp = node.get_clock().now().to_msg()
            key = os.read(sys.stdin.fileno(), 1).decode(
                errors="ignore"
            )  # not buffered: one key a turn
            if key == "q":
                return 0
            if key.isdigit() and 0 < int(key) <= len(goals):
                goal = goals[int(key) - 1]
                header = Header(stamp=stamp, frame_id=WORLD)
                guesses.publish(GoalGuess(header=header, body_id="", goal=goal))
                print(f"{time.strftime('%H:%M:%S')} {goal}")
    except KeyboardInterrupt:
        return 130
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    sys.exit(main())
