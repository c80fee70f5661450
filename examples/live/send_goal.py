"""Send one goal to a running graph, and let the simulated person reach at the same time.

Start the nodes first (see the README, "Each node by hand"), then::

    scripts/_run_in_env python examples/live/send_goal.py robot_1 --person person_1
    scripts/_run_in_env python examples/live/send_goal.py 0.45 -0.30 0.30
    scripts/_run_in_env python examples/live/send_goal.py 0.45 -0.30 0.30 --then 0.5 0.2 0.3 --after 0.8

It goes to the node that moves the robot, ptomp or policy; the goal of a policy may move on the way.

Ctrl-C cancels the goal: the robot stops.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import Cue, ReachTarget
from hri_prediction.ros.qos import reliable

OUTCOMES = {
    getattr(ReachTarget.Result, name): name
    for name in (
        "REACHED", "CANCELLED", "UNREACHABLE", "BLOCKED", "LOST_INPUT", "REJECTED", "PREEMPTED",
        "FAILED",
    )
}  # fmt: skip


class Turns:
    """Turns of a node's work, between which Ctrl-C and SIGTERM take effect.

    Within rclpy's C++ part what their handler raises comes out as an error of another kind.
    """

    def __init__(self, node: Node) -> None:
        self.node = node
        self._signals: list[int] = []
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, frame: self._signals.append(number))

    def take(self, timeout_s: float) -> None:
        """Let messages in for at most so long; raises KeyboardInterrupt, once for a signal."""
        rclpy.spin_once(self.node, timeout_sec=timeout_s)
        if self._signals:
            self._signals.clear()
            raise KeyboardInterrupt

    def until(self, future: Future, timeout_s: float = math.inf) -> bool:
        """Let messages in until an answer is there, or for so long."""
        end = time.monotonic() + timeout_s
        while not future.done() and time.monotonic() < end:
            self.take(0.1)
        return bool(future.done())


def is_heard(turns: Turns, cues: Publisher, timeout_s: float = 5.0) -> bool:
    """Wait until somebody listens to cues, and a recorder too if there is one: else the cue is lost."""
    begin = time.monotonic()
    heard = False
    while time.monotonic() < begin + timeout_s:
        turns.take(0.05)
        known = turns.node.get_subscriptions_info_by_topic(cues.topic_name)
        names = {listener.node_name for listener in known}
        heard = cues.get_subscription_count() >= len(known) and bool(names - {"recorder"})
        recorded = "recorder" in names or "recorder" not in turns.node.get_node_names()
        # Processes take up to a second to know of each other, and a recorder to find a new topic.
        if heard and recorded and time.monotonic() > begin + 1.0:
            return True
    return heard


def who_moves(turns: Turns, timeout_s: float = 5.0) -> str:
    """The node that takes goals, waiting for one; empty: there is none."""
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        turns.take(0.1)
        for mover in ("ptomp", "policy"):
            if turns.node.get_publishers_info_by_topic(f"/{mover}/reach_target/_action/status"):
                return mover
    return ""


def main() -> int:
    """Send, wait, print the result; exit code 0 when the goal was reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("goal", nargs="+", help="name of a target, or X Y Z of the tool [m]")
    parser.add_argument("--duration", type=float, default=1.5, help="wanted duration [s]")
    parser.add_argument("--person", default="", help="target of the simulated person's hand")
    parser.add_argument(
        "--then",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="where a policy's goal moves [m]",
    )
    parser.add_argument("--after", type=float, default=0.5, help="when it does [s]")
    options = parser.parse_args()
    try:
        position = [float(word) for word in options.goal] if len(options.goal) > 1 else []
    except ValueError:
        position = [float("nan")]
    if len(position) not in (0, 3) or not all(map(math.isfinite, position)):
        parser.error(f"goal {' '.join(options.goal)!r}: expected one name, or X Y Z in metres")

    # Ctrl-C must not take ROS away, over which the goal is cancelled.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = Node("send_goal")
    try:
        return send(Turns(node), options, position)
    except KeyboardInterrupt:
        # Before there was a goal, or again while it was being cancelled.
        return 130
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def send(turns: Turns, options: argparse.Namespace, position: list[float]) -> int:
    """Send cue and goal, wait for the result; the exit code."""
    node = turns.node
    mover = who_moves(turns)
    if not mover:
        print(
            "nobody serves /ptomp/reach_target or /policy/reach_target: start ptomp or policy first",
            file=sys.stderr,
        )
        return 1
    if options.then and mover != "policy":
        print("--then: only a policy's goal moves, and ptomp moves the robot", file=sys.stderr)
        return 1
    client = ActionClient(node, ReachTarget, f"{mover}/reach_target")
    client.wait_for_server(timeout_sec=5.0)
    moving = node.create_publisher(PoseStamped, "policy/goal", reliable(1))
    cues = node.create_publisher(Cue, "sim/cue", reliable(10))
    if options.person and not is_heard(turns, cues):
        print("nobody listens to /sim/cue: start the person first", file=sys.stderr)
        return 1

    goal = ReachTarget.Goal(duration=options.duration)
    if position:
        point = goal.pose.pose.position
        point.x, point.y, point.z = position
        goal.pose.header.frame_id = WORLD
    else:
        goal.target = options.goal[0]
    if options.person:
        cue = Cue(person_target=options.person, duration=1.3)
        cue.header.stamp = node.get_clock().now().to_msg()
        cue.header.frame_id = WORLD
        cues.publish(cue)

    def on_feedback(message) -> None:
        feedback = message.feedback
        print(
            f"{feedback.stage}: {feedback.distance_to_goal * 100:.1f} cm to go, "
            + (
                f"smallest separation so far {feedback.min_separation * 100:.1f} cm"
                if feedback.min_separation < 1e6
                else "nobody seen so far"
            )
        )

    sent = client.send_goal_async(goal, feedback_callback=on_feedback)
    try:
        turns.until(sent)
        answer = sent.result().get_result_async()
        if options.then and not turns.until(answer, options.after):
            later = PoseStamped()  # without a stamp: now
            later.header.frame_id = WORLD
            later.pose.position.x, later.pose.position.y, later.pose.position.z = options.then
            moving.publish(later)
            print(
                "sent on: a goal that cannot be is named on /diagnostics, and the one before stays"
            )
        turns.until(answer)
    except KeyboardInterrupt:
        # Taken by the planner, perhaps, without our having heard of it.
        cancelled = False
        if turns.until(sent, 2.0):
            asked = sent.result().cancel_goal_async()
            cancelled = turns.until(asked, 2.0) and bool(asked.result().goals_canceling)
        said = (
            "the goal is cancelled" if cancelled else "no answer: the robot may go on to the goal"
        )
        print(f"interrupted; {said}", file=sys.stderr)
        return 130
    result = answer.result().result
    print(f"{OUTCOMES[result.outcome]}: {result.reason} ({result.replans} replans)")
    return 0 if result.outcome == ReachTarget.Result.REACHED else 1


if __name__ == "__main__":
    sys.exit(main())
