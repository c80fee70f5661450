"""Trajectory controller: ros2_control's joint_trajectory_controller on Jazzy, without ROS.

A new trajectory replaces the old one at once. Until its first point is due, the reference moves
from the state last asked for to that point by a Hermite blend; then it follows the spline through
the points (linear without velocities, cubic with them, quintic with accelerations too) and holds
the last one. Trajectory time runs slower than the clock by the speed scale of the stop chain.

Where it is kinder than the original: a trajectory whose first point is too soon for how far away it
is, is joined later by a blend instead of a step; speed limits slow the path instead of breaking it;
positions outside the limits are refused; a stop is a ramp along the path. A robot that is slowed, or
was a moment ago, meets a trajectory where it is, whatever that took on its way (up to ``max_lateness``). A
trajectory that comes too late is not made up for but refused, and the motion before goes on: when its
first point is long past (``max_lateness``), or it is past and the robot is elsewhere
(``handover_tolerance``), or it was timed for another speed than that to which the robot is, or was a
moment ago, slowed, and the robot is elsewhere (``slowed_tolerance``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_prediction.config import parameter
from hri_prediction.errors import DataError
from hri_sim.simulator import splines
from hri_sim.simulator.stopchain import StopChain, StopChainConfig
from hri_sim.simulator.trajectory import (
    JointTrajectory,
    SplinePath,
    check,
    check_limits,
    joined,
)

FloatArray = NDArray[np.float64]

IDLE, TRACKING, STOPPING = "idle", "tracking", "stopping"
_FULL = 0.999  # a rate below is that of a motion that is slowed
_TRANSPORTS_S = np.array(sorted(np.arange(-4, 41) * 1e-3, key=abs))
"""How much longer, or shorter, than was reckoned with a trajectory may have been on its way [s]."""
_FINER_S = np.array(sorted(np.arange(-9, 10) * 1e-4, key=abs))
"""The same about the best of them: in a millisecond a joint moves a milliradian or two [s]."""
_TIMED_NS = 100_000_000
"""So long after a motion was slowed plans come that were timed while it was [ns]."""
_SAME_RAD = 1e-4
"""Steps that differ by less tell no transport apart [rad]."""


@dataclass(frozen=True)
class ControllerConfig(StopChainConfig):
    """Parameters of the trajectory controller and its stop chain."""

    path_tolerance: float = parameter(
        0.0,
        "Largest tracking error of a joint before the motion is dropped and held; 0: off",
        unit="rad",
        low=0.0,
        high=3.2,
    )
    goal_tolerance: float = parameter(
        0.0,
        "Largest error of a joint at the end of a motion; 0: off",
        unit="rad",
        low=0.0,
        high=3.2,
    )
    goal_time: float = parameter(
        0.5, "How long after its end a motion may take to meet goal_tolerance", unit="s", low=0.0
    )
    speed_fraction: float = parameter(
        1.0, "Share of the joints' speed limits that references keep to", low=0.05, high=1.0
    )
    blend_time: float = parameter(
        0.02, "Shortest blend to a trajectory", unit="s", low=0.001, high=0.5
    )
    blend_acceleration: float = parameter(
        30.0,
        "Acceleration by which such a blend bridges a difference; lower makes it longer",
        unit="rad/s^2",
        low=1.0,
        high=1000.0,
    )
    max_lateness: float = parameter(
        0.02, "Oldest first point that is still joined; later ones are refused", unit="s", low=0.0
    )
    handover_tolerance: float = parameter(
        0.001,
        "How far off the present motion a trajectory may be that began in the past; one that is farther "
        "is refused",
        unit="rad",
        low=0.0,
        high=3.2,
    )
    slowed_tolerance: float = parameter(
        0.002,
        "The same while the motion is slowed, or was a moment ago: then nobody can time one well",
        unit="rad",
        low=0.0,
        high=3.2,
    )


class TrajectoryController:
    """References for the joints from trajectories, a speed scale and a clock.

    Times of calls are int nanoseconds on one clock. All arrays are in the robot's joint order.

    Attributes:
        chain: The stop chain; give it the heartbeats.
        q_ref: Reference position (7,) [rad], updated in place.
        qd_ref: Reference velocity (7,) [rad/s], updated in place.
        qdd_ref: Reference acceleration (7,) [rad/s^2], updated in place.
        outcome: How the last motion ended ("" before the first).
        rejection: Why the newest trajectory was refused; empty when it was accepted.
        handover_jump_position: Largest step between old and new plan at a hand-over, |old plan at
            the time of the new plan's first point - first point|, since the motion began [rad].
        last_jump_position: The step of the last hand-over alone [rad].
        handover_jump_velocity: The same of the velocities [rad/s].
        late_refusals: Trajectories that were refused because their time was over, since the reset.
        stamp_ns: Stamp of the active (or last) trajectory [ns]; 0 before the first.
    """

    def __init__(self, robot: RobotModel, config: ControllerConfig | None = None) -> None:
        self.config = config or ControllerConfig()
        self.chain = StopChain(self.config)
        self._robot = robot
        speed = robot.velocity * self.config.speed_fraction
        self._limits = np.ascontiguousarray(np.stack((robot.lower, robot.upper, speed)))
        self._clock = np.zeros(3)
        self._path_state = np.zeros((3, 7))
        self._out = np.zeros((3, 7))
        self.q_ref, self.qd_ref, self.qdd_ref = self._out
        self.reset(np.zeros(7), 0)

    def reset(self, q: FloatArray, now_ns: int) -> None:
        """Forget everything and hold a posture.

        Args:
            q: Joint angles (7,) [rad].
            now_ns: Time now [ns].
        """
        self.chain.reset()
        self.outcome = ""
        self.rejection = ""
        self.handover_jump_position = self.last_jump_position = 0.0
        self.handover_jump_velocity = 0.0
        self.late_refusals = 0
        self.stamp_ns = 0
        self._now_ns = now_ns
        self.hold(q)

    def hold(self, q: FloatArray) -> None:
        """Ask for a posture (7,) [rad] at rest, at once; ends any motion."""
        self._path: SplinePath | None = None
        self._slowed_ns = self._now_ns - _TIMED_NS - 1
        self._clock[:] = 0.0
        self._path_state[:] = 0.0
        self._path_state[0] = q
        self._out[:] = self._path_state
        self._ended_ns: int | None = None

    @property
    def active(self) -> bool:
        """Whether a trajectory is being followed."""
        return self._path is not None

    @property
    def _standing(self) -> bool:
        """Whether a stop holds the robot at rest on its path."""
        return self._path is not None and self.chain.scale == 0.0

    @property
    def scale(self) -> float:
        """Rate of trajectory time against the clock: speed scale and speed limits together."""
        return float(self._clock[1]) if self._path is not None else self.chain.scale

    @property
    def state(self) -> str:
        """``"idle"``, ``"tracking"``, or ``"stopping"`` (on the way to, or at, a forced rest)."""
        if self._path is None:
            return IDLE
        return STOPPING if self.chain.reason else TRACKING

    @property
    def reason(self) -> str:
        """Why the controller stops, or refused the newest trajectory; empty otherwise."""
        return self.chain.reason if self._path is not None and self.chain.reason else self.rejection

    @property
    def time_in_trajectory(self) -> float:
        """Where on the active trajectory the reference is, from its stamp [s]; 0 when idle."""
        return float(self._clock[0]) if self._path is not None else 0.0

    def accept(self, trajectory: JointTrajectory, *, needs_replan: bool = False) -> None:
        """Replace the present motion, at the time of the last step; without points, stop it.

        Args:
            trajectory: The new trajectory.
            needs_replan: Stop when no further trajectory follows within ``command_timeout``.

        Raises:
            DataError: when it cannot be used (the reason is also in :attr:`rejection`); the present
                motion, with its watchdogs, goes on.
        """
        try:
            if len(trajectory.time_s) == 0:
                self.stop()
            else:
                self._replace(check(trajectory, self._robot))
                self.chain.plan_received(self._now_ns, needs_replan=needs_replan)
        except DataError as error:
            self.rejection = str(error)
            raise
        self.rejection = ""

    def stop(self) -> None:
        """Come to rest along the present path and drop it."""
        if self._path is not None:
            self.chain.halt()

    def step(self, now_ns: int, q: FloatArray | None = None) -> None:
        """Move the references to a new time.

        Args:
            now_ns: Time now [ns]; not before the last step.
            q: Measured joint angles (7,) [rad], for the tolerances.

        Raises:
            DataError: when the clock runs backwards.
        """
        if now_ns < self._now_ns:
            raise DataError(
                f"controller clock went back by {(self._now_ns - now_ns) * 1e-9:.6f} s",
                expected="increasing times",
                hint="reset the controller after a jump of the clock",
            )
        dt = (now_ns - self._now_ns) * 1e-9
        self._now_ns = now_ns
        path = self._path
        scale = self.chain.update(now_ns, dt, moving=path is not None)
        if path is None:
            return
        at_end = splines.reference(
            path.knots,
            path.coefficients,
            self._clock,
            dt,
            scale,
            self._limits,
            self._path_state,
            self._out,
        )
        if self._clock[1] < _FULL:
            self._slowed_ns = now_ns
        if q is not None and self.config.path_tolerance and self._off_path(q):
            return
        if at_end:
            self._at_end(now_ns, q)
        elif self.chain.halting and scale == 0.0:
            self._finish("stopped as asked")

    def _off_path(self, q: FloatArray) -> bool:
        error = np.abs(q - self.q_ref)
        joint = int(error.argmax())
        if error[joint] <= self.config.path_tolerance:
            return False
        self._finish(f"{self._robot.joint_names[joint]} left its path by {error[joint]:.4f} rad")
        self.hold(q)
        return True

    def _at_end(self, now_ns: int, q: FloatArray | None) -> None:
        tolerance = self.config.goal_tolerance
        if q is None or not tolerance or (error := np.abs(q - self.q_ref)).max() <= tolerance:
            self._finish("end reached")
            return
        if self._ended_ns is None:
            self._ended_ns = now_ns
        if now_ns - self._ended_ns >= self.config.goal_time * 1e9:
            joint = int(error.argmax())
            name = self._robot.joint_names[joint]
            self._finish(f"{name} missed the end by {error[joint]:.4f} rad")

    def _finish(self, outcome: str) -> None:
        self.outcome = outcome
        self.chain.motion_ended()
        self.hold(self.q_ref.copy())

    def _replace(self, path: SplinePath) -> None:
        stamp = path.stamp_ns or self._now_ns
        now = (self._now_ns - stamp) * 1e-9  # on the new path's clock
        first = float(path.knots[0])
        if path.knots[-1] < now:
            raise DataError(
                f"trajectory ended {now - path.knots[-1]:.3f} s ago",
                expected="an end in the future",
            )
        if now - first > self.config.max_lateness:
            self.late_refusals += 1
            raise DataError(
                f"trajectory began {now - first:.3f} s ago",
                expected=f"a first point at most {self.config.max_lateness} s late",
            )
        late_s = now - first
        slowed = self._clock[1] < _FULL
        lately = slowed or self._now_ns - self._slowed_ns <= _TIMED_NS
        if self._path is not None and lately and not self._standing:
            now = self._met(path, now)
        jump = self._step_to(path, max(first, now), max(first - now, 0.0))
        untimely = late_s > 0.0 or slowed
        tolerance = self.config.slowed_tolerance if lately else self.config.handover_tolerance
        if self._path is not None and untimely and jump[0] > tolerance:
            self.late_refusals += 1
            when = f"began {late_s:.3f} s ago" if late_s > 0.0 else "comes while slowed"
            raise DataError(
                f"trajectory {when}, {jump[0]:.4f} rad off the present motion",
                expected=f"at most {tolerance} rad off",
            )
        old = self._path_state.copy()  # the path's own velocity, not the scaled one
        if self._standing:
            old[1:] = 0.0
        join = max(first, now + self._bridging_time(path, now))
        knots, coefficients = joined(path, now, old, join)
        check_limits(coefficients[:1], knots[:2], self._robot, "the blend to the trajectory")
        self._note_handover(jump)
        self._path = SplinePath(stamp, knots, coefficients, path.smooth)
        self._clock[0] = now
        self._clock[2] = 0.0
        self._ended_ns = None
        self.stamp_ns = stamp

    def _met(self, path: SplinePath, now: float) -> float:
        """Where on a path a slowed robot meets it, on the path's clock [s].

        On its way a trajectory grows old by the clock, while a slowed robot hardly moves: at a tenth of
        full speed each millisecond of transport is 0.9 ms of motion too much. What it took is left out,
        as far as the places of both paths show it.

        Args:
            path: The path to come.
            now: The time by the clock [s].
        """
        coarse = now - _TRANSPORTS_S[self.config.max_lateness >= _TRANSPORTS_S]
        return self._nearest(path, self._nearest(path, coarse) - _FINER_S)

    def _nearest(self, path: SplinePath, times_s: FloatArray) -> float:
        """The first of some times on a path that is nearest to the present motion [s]."""
        first = float(path.knots[0])
        met, least = float(times_s[0]), math.inf
        for time_s in map(float, times_s):
            jump = float(self._step_to(path, max(first, time_s), max(first - time_s, 0.0))[0])
            if jump < least - _SAME_RAD:
                met, least = time_s, jump
        return met

    def _bridging_time(self, path: SplinePath, now: float) -> float:
        """How long the blend to a path takes at least: longer the farther it begins [s]."""
        begin = max(now, float(path.knots[0]))
        old = self._path_state
        if self._path is not None and not self._standing:
            old = self._path.at(float(self._clock[0]) + begin - now)
        gap = np.abs(old[:2] - path.at(begin)[:2])
        strongest = self.config.blend_acceleration
        # Quintic from rest to rest: 5.8 d / T^2 and 1.9 d / T; change of speed: 1.5 dv / T.
        return max(
            self.config.blend_time,
            math.sqrt(5.8 * float(gap[0].max()) / strongest),
            2.0 * float((gap[0] / self._limits[2]).max()),
            1.5 * float(gap[1].max()) / strongest,
        )

    def _step_to(self, path: SplinePath, new_time: float, ahead: float) -> FloatArray:
        """Largest steps of position [rad] and velocity [rad/s] (2,) to a path at one of its times.

        Args:
            path: The path to come.
            new_time: Time on it at which the two are compared [s].
            ahead: How much later than now that is [s].
        """
        new = path.at(new_time)
        if self._path is None or self._standing:
            # From rest: the plan must begin where the robot stands.
            return np.array([np.abs(self._path_state[0] - new[0]).max(), 0.0])
        # Until then both paths advance at the same rate, so by equal amounts of path time.
        old = self._path.at(float(self._clock[0]) + ahead)
        jump: FloatArray = np.abs(old[:2] - new[:2]).max(axis=1)
        return jump

    def _note_handover(self, jump: FloatArray) -> None:
        if self._path is None:
            self.handover_jump_position = self.handover_jump_velocity = 0.0
        if self._path is None or self._standing:
            self._clock[1] = self.chain.scale
        self.last_jump_position = float(jump[0])
        self.handover_jump_position = max(self.handover_jump_position, float(jump[0]))
        moved = float(self._clock[1]) * float(jump[1])
        self.handover_jump_velocity = max(self.handover_jump_velocity, moved)
