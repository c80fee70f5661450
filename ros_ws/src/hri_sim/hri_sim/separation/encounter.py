"""One person meets the robot, whose speed the monitor scales: physics, motion capture, delays."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_planner.separation.config import (
    ASSUMED,
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.monitor import SeparationMonitor, State
from hri_planner.separation.parts import SeenArm
from hri_planner.separation.robot_state import RobotState
from hri_planner.separation.timely import MOST_HELD_S, is_timely
from hri_planner.separation.track import ArmWatch
from hri_prediction.arm.geometry import SIDES, arm_capsules
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import capsule_distances
from hri_sim.separation.capture import Capture, MotionCapture
from hri_sim.separation.forecasts import Forecasts
from hri_sim.separation.intents import Chasing, Intent, Reaching, Walking, draw_changes
from hri_sim.separation.robot_motion import Motion, draw_posture, motion_to
from hri_sim.separation.visitor import LEANS, Visitor, draw_figure
from hri_sim.simulator.simulation import Simulation

FloatArray = NDArray[np.float64]

PERIOD_S = 0.004
"""Of capture and joint states [s]."""
DECIDING = 2
"""Of so many of them the monitor decides once."""
REST_M_S = 0.01
"""A robot of which no point is faster is at rest [m/s]."""
LONGEST_S = 3.0
"""Of an encounter, unless another time is set [s]."""
NEAR_M = 0.3
"""Nearer, distances are looked at twice a period [m]."""
LEANING_S = 0.2
"""An encounter is over when somebody has touched a resting robot for so long [s]."""
VISITOR = "visitor"
"""Body id of the person."""
KINDS = ("walking", "reaching", "chasing")
_MILLI = 1_000_000
_LEAD_S = 0.03  # motions begin so much later than they are sent
_LOOK_AHEAD_S = 1e-4  # step of speeds


@dataclass(frozen=True)
class Settings:
    """What encounters have in common.

    Attributes:
        distance: Of the monitor.
        body: Of the monitor.
        release: Of the monitor.
        capture: Of motion capture.
        monitored: Whether the monitor has a say; without, the robot goes at full speed.
        arms_only: Whether people are two arms and nothing else, as those are that launched runs simulate.
        duration: Longest [s].
    """

    distance: ProtectiveDistanceConfig = field(default_factory=ProtectiveDistanceConfig)
    body: BodyConfig = field(default_factory=BodyConfig)
    release: ReleaseConfig = field(default_factory=ReleaseConfig)
    capture: Capture = field(default_factory=Capture)
    monitored: bool = True
    arms_only: bool = False
    duration: float = LONGEST_S


@dataclass(frozen=True)
class Meeting:
    """What came of an encounter.

    Attributes:
        kind: What the person wanted, one of :data:`KINDS`.
        seed: Of the encounter.
        closest_moving: Smallest distance of the surfaces while the robot moved [m].
        fastest_touch: Speed of the robot's fastest point when they touched [m/s]; 0: they did not, or it
            rested.
        fastest_approach: Speed at which the robot came at who was touched, the largest [m/s]; negative:
            it was leaving; 0: there was no touch.
        closest: Smallest distance of all [m].
        turns: How often the robot's motion was replaced on its way.
        stops: How often the robot was stopped.
        stopped_s: How long it was at a stop [s].
        slowed_s: How long it was slowed [s].
        silent_s: How long the monitor said nothing [s].
        duration_s: Of the encounter [s].
    """

    kind: str
    seed: int
    closest_moving: float
    fastest_touch: float
    fastest_approach: float
    closest: float
    turns: int
    stops: int
    stopped_s: float
    slowed_s: float
    silent_s: float
    duration_s: float

    @property
    def touched(self) -> bool:
        """Whether the person was touched by a robot that moved."""
        return self.closest_moving <= 0.0


def draw_visit(
    kind: str, rng: np.random.Generator, distance: ProtectiveDistanceConfig
) -> tuple[Visitor, Intent]:
    """A person and what they want, somewhere about the robot."""
    figure = draw_figure(rng)
    around = rng.uniform(-np.pi, np.pi) if kind == "walking" else rng.normal(0.0, 0.8)
    away = rng.uniform(0.75, 1.1) if kind == "reaching" else rng.uniform(1.2, 2.0)
    place = away * np.array([np.cos(around), np.sin(around)])
    toward = np.array([0.3, 0.0]) + rng.normal(0.0, 0.25, 2) - place
    yaw = float(np.arctan2(toward[1], toward[0]))
    visitor = Visitor(figure, place, yaw, distance.arm_speed, distance.body_speed)
    if kind == "walking":
        speed, phase = rng.uniform(0.3, distance.body_speed), rng.uniform(0.0, 2.0 * np.pi)
        # Every other one walks straight through.
        changes = draw_changes(rng, LONGEST_S) if rng.integers(2) else ()
        return visitor, Walking(speed, phase, changes)
    hand = int(rng.integers(2))
    if kind == "reaching":
        aside = rng.normal(0.0, 0.08, 3)
        bend = rng.uniform(0.0, LEANS[1] - figure.lean)
        return visitor, Reaching(hand, rng.uniform(0.4, 1.2), rng.uniform(0.0, 0.5), aside, bend)
    return visitor, Chasing(hand, rng.uniform(0.0, 1.0))


class Silence(NamedTuple):
    """When the monitor says nothing.

    Attributes:
        begin_ns: From when on [ns].
        end_ns: Until when [ns]; where that is the same, never.
        deciding: Whether it hangs between reading the time and saying what it decided.
    """

    begin_ns: int = 0
    end_ns: int = 0
    deciding: bool = False


def _draw_silence(rng: np.random.Generator) -> Silence:
    """Every other monitor is killed, or hangs for a while: between two decisions or within one."""
    if rng.integers(2):
        return Silence()
    begin = rng.uniform(0.2, 2.0)
    deciding = False
    if rng.integers(2):
        seconds = LONGEST_S
    elif rng.integers(2):
        seconds = rng.uniform(0.02, 0.5)
    else:
        # As long as what was said before is still good for most of it: what comes after that is worst.
        deciding, seconds = True, rng.uniform(0.01, 0.1)
    return Silence(round(begin * 1e9), round((begin + seconds) * 1e9), deciding)


class Encounter:
    """A person meets the robot.

    Args:
        simulation: With nobody in it; is reset.
        kind: What the person wants, one of :data:`KINDS`.
        settings: Of monitor and capture.
        seed: Of everything random.
    """

    def __init__(self, simulation: Simulation, kind: str, settings: Settings, seed: int) -> None:
        self._simulation, self._kind, self._settings, self._seed = simulation, kind, settings, seed
        self._rng = rng = np.random.default_rng([seed, KINDS.index(kind)])
        self._robot: RobotModel = simulation.robot
        simulation.reset(q=draw_posture(self._robot, rng))
        self._motion: Motion | None = None
        # Every other robot goes to where it was to go; the others think better of it on the way.
        self._turn_ns = 0 if rng.integers(2) else None
        self._turns = 0
        self._visitor, self._intent = draw_visit(kind, rng, settings.distance)
        self._monitor = SeparationMonitor(
            self._robot, settings.distance, settings.body, settings.release
        )
        human = settings.distance.human
        self._watches = [ArmWatch(side, settings.release, human != ASSUMED) for side in SIDES]
        self._forecasts: Forecasts | None = None
        if human == PREDICTED:
            self._forecasts = Forecasts(VISITOR, settings.release.max_prediction_age)
        self._mocap = MotionCapture(settings.capture, PERIOD_S, rng)
        self._commands: deque[tuple[int, float]] = deque()
        self._joints: RobotState | None = None
        self._silence = _draw_silence(rng)

    def run(self) -> Meeting:
        """Until time is up."""
        simulation, settings = self._simulation, self._settings
        ticks = round(settings.duration / PERIOD_S)
        steps = round(PERIOD_S * 1e3)
        closest = closest_moving = np.inf
        touch, approach = 0.0, -np.inf
        stops, stopped, slowed, silent = 0, 0, 0, 0
        before = State.STOPPED
        gap, over = np.inf, 0
        ended = 0
        state = State.STOPPED if settings.monitored else State.FREE
        for tick in range(ticks):
            ended += 1
            now_ns = simulation.time_ns
            self._move_person(now_ns)
            self._mocap.see(now_ns, self._visitor.shape.arms)
            hangs = settings.monitored and self._silence.begin_ns <= now_ns < self._silence.end_ns
            silent += hangs
            if settings.monitored and tick % DECIDING == 0 and (not hangs or self._begins(now_ns)):
                state = self._monitor_tick(now_ns)
            self._measure_joints()
            stops += state == State.STOPPED and before != State.STOPPED
            stopped += state == State.STOPPED
            slowed += state == State.SLOWED
            before = state
            self._move_robot(now_ns)
            looks = 2 if gap < NEAR_M else 1
            for _ in range(looks):
                for _ in range(steps // looks):
                    self._deliver(simulation.time_ns)
                    simulation.step(1)
                gap, speed, toward = self._look()
                closest = min(closest, gap)
                if speed > REST_M_S:
                    closest_moving = min(closest_moving, gap)
                    if gap <= 0.0:
                        touch, approach = max(touch, speed), max(approach, toward)
            if gap <= 0.0 and speed <= REST_M_S:
                over += 1  # whoever leans on a robot that rests does so on and on
                if over * PERIOD_S > LEANING_S:
                    break
            else:
                over = 0
        return Meeting(
            self._kind,
            self._seed,
            closest_moving,
            touch,
            approach if touch else 0.0,
            closest,
            self._turns,
            stops,
            stopped * PERIOD_S,
            slowed * PERIOD_S,
            silent * PERIOD_S,
            ended * PERIOD_S,
        )

    def _move_person(self, now_ns: int) -> None:
        robot = self._robot.frames(self._simulation.q)
        self._visitor.step(self._intent.wish(self._visitor, robot, now_ns * 1e-9), PERIOD_S)

    def _begins(self, now_ns: int) -> bool:
        """Whether the monitor begins to hang in the tick of now, in the middle of deciding."""
        since_ns = now_ns - self._silence.begin_ns
        return self._silence.deciding and since_ns < round(DECIDING * PERIOD_S * 1e9)

    def _monitor_tick(self, now_ns: int) -> State:
        for stamp_ns, arms in self._mocap.arrived(now_ns):
            for watch, arm in zip(self._watches, arms, strict=True):
                watch.add(stamp_ns, arm)
            if self._forecasts is not None:
                self._forecasts.take(stamp_ns, arms)
        release = self._settings.release
        trouble = ""
        seen: list[SeenArm] = []
        for watch in self._watches:
            if watch.newest_ns is None or watch.missing:
                trouble = "not seen yet"
            elif now_ns - watch.newest_ns > release.max_sample_age * 1e9:
                trouble = "not seen for too long"
            seen += watch.at(now_ns)
        said = {} if self._forecasts is None else self._forecasts.at(now_ns)
        verdict = self._monitor.decide(now_ns, self._joints, {VISITOR: seen}, said, trouble=trouble)
        held_s = self._rng.uniform(0.0, MOST_HELD_S)
        if self._silence.begin_ns <= now_ns < self._silence.end_ns:
            held_s = (self._silence.end_ns - now_ns) * 1e-9
        if is_timely(verdict.scale, held_s):
            # What is said gets there within 8 ms.
            arrives = now_ns + round(held_s * 1e9) + int(self._rng.integers(2, 9)) * _MILLI
            self._commands.append((arrives, verdict.scale))
        return verdict.state

    def _measure_joints(self) -> None:
        """What the joints are now is known a period later, with a stamp as wrong as those of people."""
        simulation = self._simulation
        age_s = max(PERIOD_S - self._mocap.stamps_ns * 1e-9, 0.0)
        controller = simulation.controller
        rate = controller.scale if controller.active else 0.0
        self._joints = RobotState.following(
            simulation.q.copy(), simulation.qd.copy(), age_s, rate, controller.qd_ref
        )

    def _deliver(self, now_ns: int) -> None:
        chain = self._simulation.controller.chain
        if not self._settings.monitored:
            chain.command(1.0, now_ns)
        while self._commands and self._commands[0][0] <= now_ns:
            chain.command(self._commands.popleft()[1], now_ns)

    def _move_robot(self, now_ns: int) -> None:
        """The next motion, or another one in the middle of one that is not slowed."""
        controller, rng = self._simulation.controller, self._rng
        start = np.zeros((3, 7))
        if controller.active:
            if self._turn_ns is None or now_ns < self._turn_ns or controller.scale < 1.0:
                return
            assert self._motion is not None
            start = self._motion.at(controller.time_in_trajectory + _LEAD_S)
        else:
            start[0] = controller.q_ref
        motion = motion_to(
            self._robot, start, draw_posture(self._robot, rng), rng.uniform(0.2, 1.5)
        )
        if motion is None:
            return  # another one the next time
        trajectory = motion.trajectory(self._robot, now_ns + round(_LEAD_S * 1e9))
        turns = controller.active
        try:
            controller.accept(trajectory)
        except DataError:
            return  # the clock has gone on otherwise than the path: the motion goes on
        self._motion = motion
        self._turns += turns
        if self._turn_ns is not None:
            self._turn_ns = now_ns + round(rng.uniform(0.2, 0.8) * 1e9)

    def _look(self) -> tuple[float, float, float]:
        """Distance of the surfaces [m]; speeds of the robot's fastest point, and towards the person [m/s].

        The latter is what its own motion takes from the distance.
        """
        q, qd = self._simulation.q, self._simulation.qd
        points = self._robot.frames(np.array((q, q + _LOOK_AHEAD_S * qd)))
        robots = np.stack((points[:, :-1], points[:, 1:]), axis=-2).reshape(-1, 2, 3)
        shape, figure = self._visitor.shape, self._visitor.figure
        axes = arm_capsules(shape.arms).reshape(6, 2, 3)
        radii = np.concatenate((figure.arm_radii, figure.arm_radii))
        if not self._settings.arms_only:
            axes, radii = np.concatenate((axes, shape.body)), np.concatenate((radii, shape.radii))
        gaps = capsule_distances(robots, np.tile(self._robot.capsule_radii, 2), axes, radii)
        gap, gap_ahead = gaps.reshape(2, -1).min(axis=1).tolist()
        ahead = points[1] - points[0]
        speed = math.sqrt((ahead * ahead).sum(axis=-1).max()) / _LOOK_AHEAD_S
        return gap, speed, (gap - gap_ahead) / _LOOK_AHEAD_S
