"""What the planner node says of itself: status, markers, and figures of its replans."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray
from visualization_msgs.msg import MarkerArray

from hri_planner.nodes.replanning import Cycle
from hri_planner.ptomp.result import ReplanResult
from hri_planner.ptomp.situation import situation
from hri_planner.robot.model import RobotModel
from hri_planner.ros.inputs import Inputs
from hri_planner.ros.markers import plan_markers
from hri_planner.ros.status import describe_plan, percentile_figures, status_message
from hri_planner.supervision.decision import Report
from hri_prediction.ros.messages import PlannerStatus
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import NANO

FloatArray = NDArray[np.float64]

MARKERS_NS = 100_000_000


class Reporting:
    """Publishes ``ptomp/status`` and ``ptomp/markers``, and counts what replans took.

    Args:
        node: The node that says it.
        robot: The robot.
        inputs: What the node has heard.
        default_duration_s: Stands in where there is no goal [s].
    """

    def __init__(
        self, node: HriNode, robot: RobotModel, inputs: Inputs, default_duration_s: float
    ) -> None:
        self._robot = robot
        self._inputs = inputs
        self._default_duration_s = default_duration_s
        self._status = node.announce(PlannerStatus, "ptomp/status", reliable(10))
        self._markers = node.announce(MarkerArray, "ptomp/markers", reliable(1))
        self._next_markers_ns = 0
        self._iterations: int | None = None
        self._compute_ms: deque[float] = deque(maxlen=1000)
        self._late_ms: deque[float] = deque(maxlen=1000)

    def restart(self, now_ns: int) -> None:
        """The clock went back to a time [ns]."""
        self._next_markers_ns = now_ns

    def distance(self, target: FloatArray) -> float:
        """Of the tool to a position (3,) [m]."""
        return float(np.linalg.norm(self._robot.frames(self._inputs.q)[3] - target))

    def made(self, cycle: Cycle, now_ns: int) -> None:
        """A replan for something that goes on is ready."""
        self._compute_ms.append(cycle.compute_s * 1e3)
        self._late_ms.append((now_ns - cycle.interval.handover_ns) / 1e6)

    def say(self, now_ns: int, report: Report, duration_s: float | None) -> None:
        """Publish a status; ``duration_s`` [s] is that of the present motion's goal, if it has one."""
        self._status.publish(self._message(now_ns, report, duration_s))

    def say_plan(
        self,
        now_ns: int,
        report: Report,
        duration_s: float | None,
        cycle: Cycle,
        *,
        due_ns: int,
        due_s: float,
    ) -> None:
        """Publish the status of a plan that was sent, and now and then its markers.

        Args:
            now_ns: The time [ns].
            report: What there is to say.
            duration_s: Of the present motion's goal [s]; none without one.
            cycle: What made the plan.
            due_ns: When its first point is due [ns].
            due_s: When it was planned to be due, plan clock [s].
        """
        result = cycle.result
        self._iterations = result.iterations
        status = self._message(now_ns, report, duration_s, result, (due_ns - now_ns) / NANO)
        describe_plan(
            status, result, due_ns=due_ns, due_s=due_s, newest_sample_ns=cycle.newest_sample_ns
        )
        self._status.publish(status)
        if now_ns >= self._next_markers_ns:
            self._next_markers_ns = now_ns + MARKERS_NS
            self._markers.publish(plan_markers(result.plan, self._robot, now_ns))

    def figures(self) -> dict[str, Any]:
        """For /diagnostics: time and lateness of replans, iterations of the newest plan."""
        figures: dict[str, Any] = percentile_figures("compute_ms", self._compute_ms)
        figures |= percentile_figures("lateness_ms", self._late_ms)
        if self._iterations is not None:
            figures["iterations"] = self._iterations
        return figures

    def _message(
        self,
        now_ns: int,
        report: Report,
        duration_s: float | None,
        result: ReplanResult | None = None,
        start_in_s: float = 0.0,
    ) -> PlannerStatus:
        inputs = self._inputs
        return status_message(
            now_ns,
            report,
            situation=situation(
                inputs.uncertainties,
                inputs.errors,
                inputs.separation(self._robot),
                self._default_duration_s if duration_s is None else duration_s,
                result,
                start_in_s,
            ),
            distance=0.0 if report.target is None else self.distance(report.target),
            reference=inputs.reference,
        )
