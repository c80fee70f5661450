"""Separation monitor node: scales the speed of the robot, and stops it before a person can touch it.

It needs motion capture and the robot alone: planner, policy and predictor may be dead. It is no certified
safety function: nothing here is redundant, and none of the software below it is made for that.
"""

from __future__ import annotations

import time
from collections import deque
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header

from hri_planner.robot.model import load_robot
from hri_planner.ros.bodies import BodyTopics
from hri_planner.ros.conversions import joints_from_message, reference_from_message
from hri_planner.ros.heartbeat import SEPARATION_STATUS, SPEED_SCALE
from hri_planner.ros.inputs import NOBODY
from hri_planner.ros.people import People, WatchedArms, WatchedPredictions, unseen_arms
from hri_planner.ros.status import percentile_figures
from hri_planner.separation.config import (
    ASSUMED,
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.monitor import SeparationMonitor, State, Verdict
from hri_planner.separation.robot_state import RobotState
from hri_planner.supervision.beat import Beat
from hri_planner.warm import warm_separation
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import ControllerState, IdsList, SeparationStatus
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_ns, to_time

PERIOD_S = 0.008
HEARTBEAT_NS = 20_000_000
WATCHING_NS = 500_000_000
"""So often it is looked whether anybody says who is tracked [ns]."""
TRACKED = "humans/bodies/tracked"
LIMIT_SLACK = 0.1
"""Joint angles that are farther beyond the limits are none [rad]."""


class SeparationMonitorNode(HriNode):
    """Says how fast the robot may be, 50 times a second and whenever that changes."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("separation_monitor", period_s=PERIOD_S, **kwargs)
        self._distance = declare_config(self, ProtectiveDistanceConfig)
        body = declare_config(self, BodyConfig)
        self._release = declare_config(self, ReleaseConfig)
        self._robot = load_robot()
        self._monitor = SeparationMonitor(self._robot, self._distance, body, self._release)
        self._people = People(self._release, measures=self._distance.human != ASSUMED)
        self._q, self._qd = np.zeros(7), np.zeros(7)
        self._joints_ns: int | None = None
        self._reference: ControllerState | None = None
        self._last_ns = 0
        self._sent: float | None = None
        self._said: State | None = None
        self._verdict: Verdict | None = None
        self._trouble = ""
        self._stops = 0
        self._beat, self._status_beat = Beat(HEARTBEAT_NS), Beat(HEARTBEAT_NS)
        self._watch_beat, self._watched = Beat(WATCHING_NS), True
        self._decide_ms: deque[float] = deque(maxlen=1000)
        warm_separation()
        self._speed_scale = self.announce(Float64, SPEED_SCALE, reliable(1))
        self._status = self.announce(SeparationStatus, SEPARATION_STATUS, reliable(10))
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.listen(
            ControllerState, "joint_trajectory_controller/reference", self._on_reference, SENSOR
        )
        self._arms = WatchedArms(self, self._people)
        self._followers: list[BodyTopics] = [self._arms]
        if self._distance.human == PREDICTED:
            radii = np.array([body.radius_upper_arm, body.radius_forearm, body.radius_hand])
            self._followers.append(WatchedPredictions(self, self._people, radii))
        self.listen(IdsList, TRACKED, self._on_ids, LATCHED)
        if unseen := unseen_arms(self._release, self._distance.intrusion):
            self.get_logger().warning(unseen)

    # ------------------------------------------------------------------ what is heard
    def _on_ids(self, message: IdsList) -> None:
        for follower in self._followers:
            follower.take(message)

    def _on_joints(self, message: JointState) -> None:
        try:
            self._q, self._qd = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._joints_ns = to_ns(message.header.stamp)

    def _on_reference(self, message: ControllerState) -> None:
        try:
            self._reference = reference_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("reference", str(error))

    def _robot_state(self, now_ns: int) -> tuple[RobotState | None, str]:
        """How the robot moves, or why nobody knows."""
        if self._joints_ns is None:
            return None, "no /joint_states yet"
        age = (now_ns - self._joints_ns) / NANO
        if age > self._release.max_joint_age:
            return None, "/joint_states have stopped"
        if age < -self._release.max_future:
            return None, "/joint_states are stamped in the future"
        reference = self._reference
        if reference is None:
            return None, "no reference of the controller yet"
        reference_age = (now_ns - to_ns(reference.header.stamp)) / NANO
        if reference_age > self._release.max_joint_age:
            return None, "the controller's reference has stopped"
        if reference_age < -self._release.max_future:
            return None, "the controller's reference is stamped in the future"
        if not self._robot.within_limits(self._q, LIMIT_SLACK):
            return None, "/joint_states are beyond the joint limits: are they in radians?"
        # A robot without a trajectory may set out at any moment, and nobody knows how fast.
        idle = reference.state == ControllerState.IDLE
        rate = 0.0 if idle else float(np.clip(reference.speed_scale, 0.0, 1.0))
        qd_ref = np.asarray(reference.reference_velocity)
        apart = abs(reference_age - age)
        return RobotState.following(self._q, self._qd, max(age, 0.0), rate, qd_ref, apart), ""

    def _nobody_watches(self, now_ns: int) -> str:
        """Whether whoever said that nobody is there is gone: then somebody may be."""
        if self._people.tracked is None or not self._release.require_tracking:
            return ""
        if self._watch_beat.due(now_ns):
            self._watched = self.count_publishers(self.resolve_topic_name(TRACKED)) > 0
        return "" if self._watched else "nothing says any longer who is tracked"

    # ------------------------------------------------------------------ work
    def on_tick(self, now_ns: int) -> None:
        """Decide, and say so."""
        if now_ns < self._last_ns:
            self.fault("clock", f"the clock went back by {(self._last_ns - now_ns) / NANO:.3f} s")
            self._people.forget()
            self._joints_ns = self._reference = None
            self._monitor.restart()
            self._beat.at_once(now_ns)
            self._watch_beat.at_once(now_ns)
            self._status_beat.at_once(now_ns)
        self._last_ns = now_ns
        begin = time.perf_counter()
        self._arms.look(now_ns)
        robot, unknown = self._robot_state(now_ns)
        self._trouble = unknown or self._people.trouble(now_ns) or self._nobody_watches(now_ns)
        verdict = self._monitor.decide(
            now_ns,
            robot,
            self._people.arms(now_ns),
            self._people.predictions(now_ns),
            trouble=self._trouble,
        )
        self._decide_ms.append((time.perf_counter() - begin) * 1e3)
        stopped = verdict.state == State.STOPPED and self._said not in (None, State.STOPPED)
        self._stops += stopped
        self._verdict = verdict
        if self._beat.due(now_ns) or verdict.scale != self._sent:
            self._sent = verdict.scale
            self._speed_scale.publish(Float64(data=verdict.scale))
        if self._status_beat.due(now_ns) or verdict.state != self._said:
            self._said = verdict.state
            self._status.publish(self._message(now_ns, verdict))

    def _message(self, now_ns: int, verdict: Verdict) -> SeparationStatus:
        config = self._distance
        return SeparationStatus(
            header=Header(stamp=to_time(now_ns)),
            state=int(verdict.state),
            reason=verdict.reason,
            speed_scale=verdict.scale,
            distance=min(verdict.distance, NOBODY),
            protective_distance=verdict.protective,
            margin=min(verdict.margin, NOBODY),
            s_h=verdict.human,
            s_r=verdict.reaction,
            s_s=verdict.stopping,
            c=config.intrusion,
            z_d=config.sensor_error,
            z_r=config.robot_error,
            robot_speed=verdict.robot_speed,
            human_speed=verdict.human_speed,
            robot_part=verdict.robot_part,
            body_id=verdict.body_id,
            human_part=verdict.human_part,
            human_mode=verdict.mode,
        )

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """What the robot may do and why; whether somebody else commands its speed."""
        verdict = self._verdict
        figures: dict[str, Any] = {
            "stops": self._stops,
            "jumps": self._people.jumps,
            **percentile_figures("decide_ms", self._decide_ms),
        }
        if verdict is None:
            return WARN, "has not decided yet", figures
        figures |= {
            "speed_scale": f"{verdict.scale:.3f}",
            "distance_m": f"{min(verdict.distance, NOBODY):.3f}",
            "protective_distance_m": f"{verdict.protective:.3f}",
        }
        others = self.count_publishers(self._speed_scale.topic) - 1
        if others > 0:
            # The robot goes as fast as the last one said: what is stopped here goes on there.
            text = (
                f"{others} more publish {self._speed_scale.topic}, which overrules this monitor: "
                "end them, or start them with heartbeat:=false"
            )
            return ERROR, text, figures
        if self._trouble:
            return WARN, f"the robot is stopped: {self._trouble}", figures
        unlisted = self._people.unlisted(self._last_ns)
        if unlisted:
            text = (
                f"still seen, but no longer listed on /{TRACKED}: {', '.join(unlisted)}; they are "
                "reckoned with: do two sources say who is tracked?"
            )
            return WARN, text, figures
        return OK, verdict.reason or verdict.state.name.lower(), figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(SeparationMonitorNode, args)
