"""Separation monitor node: scales the speed of the robot, and stops it before a person can touch it.

It needs motion capture and the robot alone: planner, policy and predictor may be dead. It is no certified
safety function: nothing here is redundant, and none of the software below it is made for that.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
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
from hri_planner.separation.parts import SeenArm, parts_of
from hri_planner.separation.robot_state import RobotState
from hri_planner.separation.robot_watch import JointWatch
from hri_planner.separation.timely import MOST_HELD_S, TRANSPORT_S, is_timely
from hri_planner.warm import warm_separation
from hri_prediction.beat import Beat
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.ros.messages import ControllerState, IdsList, SeparationStatus
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_prediction.ros.tracked import TRACKED, take_list

PERIOD_S = 0.008
STATUS_NS = 20_000_000
"""From one status to the next, unless the state changes [ns]; the speed scale is said with every tick."""
HELD_UP = "this node was held up in the middle of saying what it decided"
LIMIT_SLACK = 0.1
"""Joint angles that are farther beyond the limits are none [rad]."""


class SeparationMonitorNode(HriNode):
    """Says how fast the robot may be, with every tick."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("separation_monitor", period_s=PERIOD_S, **kwargs)
        self._distance = declare_config(self, ProtectiveDistanceConfig)
        self._body = body = declare_config(self, BodyConfig)
        self._release = declare_config(self, ReleaseConfig)
        self._robot = load_robot()
        self._monitor = SeparationMonitor(self._robot, self._distance, body, self._release)
        self._people = People(self._release, measures=self._distance.human != ASSUMED)
        self._q, self._qd = np.zeros(7), np.zeros(7)
        self._joints_ns: int | None = None
        self._placed = False
        self._reference: ControllerState | None = None
        self._last_ns = 0
        self._said: State | None = None
        self._verdict: Verdict | None = None
        self._trouble = ""
        self._asked_speed = self._asked_gain = 0.0
        self._stops = self._unsaid = self._disbelieved = 0
        self._said_s: float | None = None
        self._status_beat = Beat(STATUS_NS)
        self._joint_watch = JointWatch(self._release.joint_speed_error)
        self._decide_ms: deque[float] = deque(maxlen=1000)
        warm_separation()
        self._speed_scale = self.announce(Float64, SPEED_SCALE, reliable(1))
        self._status = self.announce(SeparationStatus, SEPARATION_STATUS, reliable(10))
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.listen(
            ControllerState, "joint_trajectory_controller/reference", self._on_reference, SENSOR
        )
        radii = np.array([body.radius_upper_arm, body.radius_forearm, body.radius_hand])
        self._arms = WatchedArms(self, self._people, self._near)
        self._followers: list[BodyTopics] = [self._arms]
        if self._distance.human == PREDICTED:
            self._followers.append(WatchedPredictions(self, self._people, radii))
        self.listen(IdsList, TRACKED, self._on_ids, LISTS)
        if unseen := unseen_arms(self._release, self._distance.intrusion):
            self.get_logger().warning(unseen)

    # ------------------------------------------------------------------ what is heard
    def _on_ids(self, message: IdsList) -> None:
        take_list(self._people.lists, message, self.tick_ns)
        for follower in self._followers:
            follower.follow()

    def _on_joints(self, message: JointState) -> None:
        try:
            self._q, self._qd = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._joints_ns, self._placed = to_ns(message.header.stamp), True
        self._joint_watch.take(self._joints_ns, self._q, self._qd)

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
        watch = self._joint_watch
        if watch.mixed:
            return None, "/joint_states come from two sources that contradict each other"
        if watch.contradicts:
            name = self._robot.joint_names[watch.joint]
            return None, f"the speed of {name} in /joint_states contradicts its angle"
        # A robot without a trajectory may set out at any moment, and nobody knows how fast.
        idle = reference.state == ControllerState.IDLE
        rate = 0.0 if idle else float(np.clip(reference.speed_scale, 0.0, 1.0))
        qd_ref = np.asarray(reference.reference_velocity)
        apart = abs(reference_age - age)
        return RobotState.following(self._q, self._qd, max(age, 0.0), rate, qd_ref, apart), ""

    def _near(self, arms: Sequence[SeenArm], points: np.ndarray) -> bool:
        """Whether somebody is so near the robot, wherever that is, that they are not forgotten."""
        if not self._placed:
            return True
        parts = parts_of("", arms, self._body)
        ends = [part.ends for part in parts] + [np.stack((point, point)) for point in points]
        if not ends:
            return False
        thickest = max(self._body.radius_upper_arm, self._body.radius_forearm)
        radii = [part.radius for part in parts] + [thickest] * len(points)
        gaps = capsule_distances(
            self._robot.robot_capsules(self._q),
            self._robot.capsule_radii,
            np.stack(ends),
            np.array(radii),
        )
        return bool(gaps.min() < self._release.leave_distance)

    # ------------------------------------------------------------------ work
    def on_tick(self, now_ns: int) -> None:
        """Decide, and say so."""
        if now_ns < self._last_ns:
            self.fault("clock", f"the clock went back by {(self._last_ns - now_ns) / NANO:.3f} s")
            self._people.forget(now_ns)
            self._joints_ns = self._reference = None
            self._joint_watch.restart()
            self._monitor.restart()
            self._status_beat.at_once(now_ns)
        self._last_ns = now_ns
        begin = time.perf_counter()
        self._arms.look(now_ns)
        robot, unknown = self._robot_state(now_ns)
        self._trouble = unknown or self._people.trouble(now_ns)
        verdict = self._monitor.decide(
            now_ns,
            robot,
            self._people.arms(now_ns),
            self._people.predictions(now_ns),
            trouble=self._trouble,
        )
        took_s = time.perf_counter() - begin
        said = self._say(verdict.scale)  # at once: all that follows may take its time
        self._decide_ms.append(took_s * 1e3)
        self._check_path()
        self._disbelieved += bool(self._monitor.disbelieved)
        for body_id, side in self._monitor.disbelieved:
            text = f"the {side} arm of {body_id} is not where it was predicted to be by now"
            self.fault("disbelieved", f"{text}: that prediction counts for nothing")
        if said is None:
            return
        if said != verdict.scale:
            verdict = replace(verdict, state=State.STOPPED, scale=said, reason=HELD_UP)
        stopped = verdict.state == State.STOPPED and self._said not in (None, State.STOPPED)
        self._stops += stopped
        self._verdict = verdict
        if self._status_beat.due(now_ns) or verdict.state != self._said:
            self._said = verdict.state
            self._status.publish(self._message(now_ns, verdict))

    def _say(self, scale: float) -> float | None:
        """Say how fast the robot may be, unless that was decided too long ago; what was said, or None."""
        self._notice_silence()
        if not is_timely(scale, self.held_s()):
            self._unsaid += 1
            return None
        self._speed_scale.publish(Float64(data=scale))
        self._said_s = self._steady_s()
        if is_timely(scale, self.held_s()):
            return scale
        # Held up since it looked at the clock: what was just said is taken back, which stops the robot.
        self._speed_scale.publish(Float64(data=0.0))
        self._unsaid += 1
        text = f"{HELD_UP}, for {self.held_s() * 1e3:.0f} ms"
        self.fault("held_up", f"{text}: the robot is not let go on that")
        return 0.0

    def _notice_silence(self) -> None:
        """Whether nothing was said for so long that the controller has begun to stop the robot."""
        silent_s = 0.0 if self._said_s is None else self._steady_s() - self._said_s
        if silent_s > self._distance.reaction_time - MOST_HELD_S - TRANSPORT_S:
            text = f"this node was held up and said nothing for {silent_s * 1e3:.0f} ms"
            self.fault("held_up", f"{text}: the controller does not wait for so long")

    def _steady_s(self) -> float:
        """A clock that nobody sets [s]."""
        return self.tick_ns / NANO if self.lockstep else time.perf_counter()

    def _check_path(self) -> None:
        """Whether paths ask for more than is reckoned with of a robot that sets out or speeds up."""
        path, config = self._monitor.path, self._distance
        if path.fastest > max(config.robot_speed, self._asked_speed):
            self._asked_speed = path.fastest
            text = f"a path asks for {path.fastest:.2f} m/s"
            self.fault("robot_speed", f"{text}, more than robot_speed = {config.robot_speed:g}")
        if path.gained > max(config.robot_acceleration, self._asked_gain):
            self._asked_gain = path.gained
            text = f"a path asks for {path.gained:.1f} m/s^2"
            reckoned = f"robot_acceleration = {config.robot_acceleration:g}"
            self.fault("robot_acceleration", f"{text}, more than {reckoned}")

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
            "unsaid": self._unsaid,
            "jumps": self._people.jumps,
            "disbelieved": self._disbelieved,
            "path_speed_m_s": f"{self._monitor.path.fastest:.2f}",
            "path_gain_m_s2": f"{self._monitor.path.gained:.1f}",
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
            # The least of all counts; but whoever speaks keeps a robot moving whose monitor hangs.
            text = (
                f"{others} more publish {self._speed_scale.topic}: should this monitor hang, nothing stops "
                "the robot. End them, or start them with heartbeat:=false"
            )
            return ERROR, text, figures
        if self._trouble:
            return WARN, f"the robot is stopped: {self._trouble}", figures
        unlisted = self._people.unlisted(self._last_ns)
        if unlisted:
            text = (
                f"still seen, but no longer listed on /{TRACKED}: {', '.join(unlisted)}; they are "
                "reckoned with: why does their source not list them?"
            )
            return WARN, text, figures
        return OK, verdict.reason or verdict.state.name.lower(), figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(SeparationMonitorNode, args)
