"""What the policy node says of itself: status, and figures of its cycles."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header

from hri_planner.nodes.policy_replanning import PolicyCycle
from hri_planner.robot.model import RobotModel
from hri_planner.ros.inputs import NOBODY, RobotInputs
from hri_planner.ros.status import percentile_figures
from hri_planner.supervision.decision import Report
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import PolicyStatus
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import to_time

FloatArray = NDArray[np.float64]


class PolicyReporting:
    """Publishes ``policy/status``, and counts what cycles took.

    Args:
        node: The node that says it.
        robot: The robot.
        inputs: What the node has heard.
        policy: Name of the policy.

    Attributes:
        policy: Name of the policy.
    """

    def __init__(self, node: HriNode, robot: RobotModel, inputs: RobotInputs, policy: str) -> None:
        self._robot = robot
        self._inputs = inputs
        self.policy = policy
        self._status = node.announce(PolicyStatus, "policy/status", reliable(10))
        self._compute_ms: deque[float] = deque(maxlen=1000)
        self._late_ms: deque[float] = deque(maxlen=1000)
        self._filtered = 0

    def restart(self, now_ns: int) -> None:
        """The clock went back to a time [ns]: nothing here depends on it."""

    def distance(self, target: FloatArray) -> float:
        """Of the tool to a position (3,) [m]."""
        return float(np.linalg.norm(self._robot.frames(self._inputs.q)[3] - target))

    def made(self, made: PolicyCycle, now_ns: int) -> None:
        """A cycle for something that goes on is ready."""
        self._compute_ms.append(made.compute_s * 1e3)
        self._late_ms.append((now_ns - made.interval.handover_ns) / 1e6)
        self._filtered += made.result.hand.filtered

    def say(self, now_ns: int, report: Report, duration_s: float | None) -> None:
        """Publish a status."""
        self._status.publish(self._message(now_ns, report))

    def say_plan(
        self,
        now_ns: int,
        report: Report,
        duration_s: float | None,
        made: PolicyCycle,
        *,
        due_ns: int,
        due_s: float,
    ) -> None:
        """Publish the status of a plan that was sent, due at ``due_ns`` [ns]."""
        status, result = self._message(now_ns, report), made.result
        status.handover = to_time(due_ns)
        status.newest_sample = to_time(made.newest_sample_ns)
        status.goal = result.goal
        status.hand, status.velocity = result.hand.position, result.hand.velocity
        status.acceleration = result.hand.acceleration
        status.filtered = result.filtered
        status.partner_distance = min(result.nearest, NOBODY)
        self._status.publish(status)

    def figures(self) -> dict[str, Any]:
        """For /diagnostics."""
        figures: dict[str, Any] = {"policy": self.policy, "filtered_cycles": self._filtered}
        figures |= percentile_figures("compute_ms", self._compute_ms)
        return figures | percentile_figures("lateness_ms", self._late_ms)

    def _message(self, now_ns: int, report: Report) -> PolicyStatus:
        reference = self._inputs.reference
        message = PolicyStatus(
            header=Header(stamp=to_time(now_ns), frame_id=WORLD),
            stage=int(report.stage),
            reason=report.reason,
            policy=self.policy,
            motion=report.number,
            cycle=report.replans,
            deadline_misses=report.misses,
            clearance=min(self._inputs.separation(self._robot), NOBODY),
            distance_to_goal=0.0 if report.target is None else self.distance(report.target),
            speed_scale=report.speed_scale,
            handover_jump=0.0 if reference is None else reference.max_handover_jump,
            partner_distance=NOBODY,
        )
        if report.target is not None:
            message.goal = report.target
        return message
