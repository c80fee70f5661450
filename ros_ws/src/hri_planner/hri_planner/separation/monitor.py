"""Speed and separation monitoring: from what is seen of robot and people to how fast the robot may be.

The robot is slowed as little as it must be for the protective distance to be no more than the distance,
part by part; below a least speed it is stopped, and let go when there has been room enough for a while.
What is missing, or too old to go by, stops it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import CAPSULE_NAMES, RobotModel
from hri_planner.separation.config import (
    HUMAN_MODES,
    MEASURED,
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.pairs import (
    DISTANCE,
    LINK,
    PART,
    PROTECTIVE,
    RAISED,
    ROW,
    SCALE,
    PartArrays,
    fastest_of,
    least_allowed,
    robot_ends,
)
from hri_planner.separation.parts import Part, SeenArm, parts_of
from hri_planner.separation.predicted import NOISE_SIGMAS, ArmPrediction, believed
from hri_planner.separation.robot_state import RobotState
from hri_planner.separation.robot_watch import PathWatch
from hri_planner.separation.travel import (
    ASSUMED_MODE,
    CONTACT_SPEED,
    EVASION,
    FIXED,
    HUMAN_ACCELERATION,
    HUMAN_SPEED,
    MEASURED_MODE,
    NOISE,
    PARAMETERS,
    PREDICTED_MODE,
    REACTION,
    ROBOT_ACCELERATION,
    ROBOT_AGE,
    ROBOT_SPEED,
    S_H,
    S_R,
    S_S,
    SETTLING,
    SIGMAS,
    SPEED_ERROR,
    START_SPEED,
    STOPPING,
)
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]
NANO = 1_000_000_000
STEP = 0.01
"""Scales are multiples of it."""


class State(IntEnum):
    """What the monitor does; as in hri_msgs/SeparationStatus."""

    FREE = 0
    SLOWED = 1
    STOPPED = 2


@dataclass(frozen=True)
class Verdict:
    """How fast the robot may be, and why.

    Lengths are in metres and are those of the pair of parts that allows least; infinite distances when
    nobody is there.

    Attributes:
        state: What the monitor does.
        scale: Speed scale that is commanded, 0...1.
        reason: Why the robot is not at full speed; empty when it is.
        distance: Of the surfaces, as they were seen last.
        protective: Protective distance at the present speed.
        human: S_h: how far the person comes until the robot rests.
        reaction: S_r: how far the robot goes until it begins to stop.
        stopping: S_s: how far it goes while it stops.
        robot_speed: Of the robot's part towards the person [m/s].
        human_speed: That is reckoned with for the person [m/s].
        robot_part: Name of the robot's part; empty when nobody is there.
        body_id: Whose part it is.
        human_part: Name of the person's part.
        mode: What is reckoned with for that part, one of :data:`HUMAN_MODES`.
    """

    state: State
    scale: float
    reason: str = ""
    distance: float = np.inf
    protective: float = 0.0
    human: float = 0.0
    reaction: float = 0.0
    stopping: float = 0.0
    robot_speed: float = 0.0
    human_speed: float = 0.0
    robot_part: str = ""
    body_id: str = ""
    human_part: str = ""
    mode: str = ""

    @property
    def margin(self) -> float:
        """What the distance has more than the protective distance [m]."""
        return self.distance - self.protective


class SeparationMonitor:
    """Decides again and again how fast the robot may be.

    Args:
        robot: Its model.
        distance: What the protective distance is made of.
        body: What people are made of.
        release: When the robot is slowed, stopped and let go.

    Attributes:
        path: What paths have asked of the robot so far.
        disbelieved: Arms, by body id and side, that are not seen where they were predicted to be by now.

    Raises:
        ConfigError: when stamps may be farther ahead than clocks are reckoned to differ.
    """

    def __init__(
        self,
        robot: RobotModel,
        distance: ProtectiveDistanceConfig,
        body: BodyConfig,
        release: ReleaseConfig,
    ) -> None:
        if release.max_future > distance.stamp_error:
            raise ConfigError(
                f"max_future = {release.max_future:g} s, stamp_error = {distance.stamp_error:g} s",
                expected="max_future no larger than stamp_error",
                hint="a stamp that is farther ahead shows that clocks differ by more than is reckoned with",
            )
        self._robot, self._distance, self._body, self._release = robot, distance, body, release
        self.path = PathWatch()
        self.disbelieved: frozenset[tuple[str, str]] = frozenset()
        self._par = parameter_vector(distance)
        self._ends, self._moving = np.empty((4, 3)), np.empty((4, 3))
        self._row = np.zeros(ROW)
        self._buffers: PartArrays | None = None
        self.restart()

    def restart(self) -> None:
        """Begin anew, stopped: nothing that was known counts any more."""
        self._scale = 0.0
        self._room_since_ns: int | None = None
        self._rates: deque[tuple[int, float]] = deque()

    def decide(
        self,
        now_ns: int,
        robot: RobotState | None,
        people: Mapping[str, Sequence[SeenArm]],
        predictions: Mapping[tuple[str, str], ArmPrediction] | None = None,
        *,
        trouble: str = "",
    ) -> Verdict:
        """How fast the robot may be from now on.

        Args:
            now_ns: The time [ns].
            robot: How the robot moves; none: nobody knows.
            people: Arms of each person who is tracked, by body id.
            predictions: By body id and side, for human = predicted.
            trouble: Why the robot must not move whatever the distance; empty: nothing.
        """
        self.disbelieved = frozenset()
        if robot is None:
            return self._stop(trouble or "nobody knows where the robot is")
        path_speed = self._path_speed(now_ns, robot)
        unseen = [who for who, arms in people.items() if not arms]
        if unseen and not trouble:
            trouble = f"no arm of {unseen[0]} yet"
        parts = [part for who, arms in people.items() for part in parts_of(who, arms, self._body)]
        if not parts:
            return self._stop(trouble) if trouble else self._command(now_ns, 1.0, 1.0, None)
        arrays = self._arrays(parts, predictions or {})
        # Measured by another clock.
        self._par[ROBOT_AGE] = robot.age_s + self._distance.stamp_error
        ends, moving, row = self._ends, self._moving, self._row
        robot_ends(robot.q, robot.qd, self._robot.lengths, ends, moving)
        least_allowed(
            ends,
            moving,
            self._robot.capsule_radii,
            robot.rate,
            self._slowest(now_ns, robot.rate),
            path_speed,
            *arrays,
            self._release.release_margin,
            self._par,
            row,
        )
        part = parts[int(row[PART])]
        mode = HUMAN_MODES[int(arrays.modes[int(row[PART])])]
        if trouble:
            return self._stop(trouble, row, part, mode)
        return self._command(now_ns, float(row[SCALE]), float(row[RAISED]), (row, part, mode))

    def _path_speed(self, now_ns: int, robot: RobotState) -> float:
        """Of the fastest point of the path, at full rate [m/s]; below 0: not known."""
        if robot.path_qd is None:
            self.path.take(now_ns, robot.rate, None)
            return -1.0
        robot_ends(robot.q, robot.path_qd, self._robot.lengths, self._ends, self._moving)
        self.path.take(now_ns, robot.rate, self._moving)
        return fastest_of(self._moving)

    def _slowest(self, now_ns: int, rate: float) -> float:
        """The least rate of as long as the arm needs to follow: what it does now is of then."""
        if np.isnan(rate):
            return rate
        rates = self._rates
        while rates and (rates[-1][1] >= rate or rates[-1][0] > now_ns):
            rates.pop()  # what is newer and no faster says more; a clock that went back begins anew
        rates.append((now_ns, rate))
        while rates[0][0] < now_ns - round(self._distance.settling_time * NANO):
            rates.popleft()
        return rates[0][1]

    def _command(
        self,
        now_ns: int,
        allowed: float,
        raised: float,
        pair: tuple[FloatArray, Part, str] | None,
    ) -> Verdict:
        release = self._release
        if min(allowed, self._scale) < release.min_scale:
            # At rest, or to be stopped: let go after some time with room.
            if raised < release.min_scale:
                self._room_since_ns = None
            elif self._room_since_ns is None or now_ns < self._room_since_ns:
                self._room_since_ns = now_ns
            waited = self._room_since_ns is not None and (
                now_ns - self._room_since_ns >= round(release.release_time * NANO)
            )
            self._scale = raised if waited else 0.0
        else:
            self._room_since_ns = None
            self._scale = min(allowed, max(self._scale, raised))
        # Smaller steps would be sent again and again, for nothing.
        scale = self._scale = math.floor(self._scale / STEP + 1e-6) * STEP
        if scale >= 1.0:
            return self._verdict(State.FREE, 1.0, "", pair)
        state = State.SLOWED if scale > 0.0 else State.STOPPED
        if state == State.STOPPED and self._room_since_ns is not None:
            return self._verdict(state, scale, "room again: the robot goes on in a moment", pair)
        assert pair is not None  # without people nothing slows the robot
        row, part, _ = pair
        near = f"the {part.name} of {part.body_id} is {100.0 * row[DISTANCE]:.0f} cm away"
        return self._verdict(state, scale, near, pair)

    def _stop(
        self, why: str, row: FloatArray | None = None, part: Part | None = None, mode: str = ""
    ) -> Verdict:
        self.restart()
        pair = None if row is None or part is None else (row, part, mode)
        return self._verdict(State.STOPPED, 0.0, why, pair)

    def _verdict(
        self, state: State, scale: float, why: str, pair: tuple[FloatArray, Part, str] | None
    ) -> Verdict:
        if pair is None:
            return Verdict(state, scale, why)
        row, part, mode = pair
        return Verdict(
            state,
            scale,
            why,
            distance=float(row[DISTANCE]),
            protective=float(row[PROTECTIVE]),
            human=float(row[S_H]),
            reaction=float(row[S_R]),
            stopping=float(row[S_S]),
            robot_speed=float(row[ROBOT_SPEED]),
            human_speed=float(row[HUMAN_SPEED]),
            robot_part=CAPSULE_NAMES[int(row[LINK])],
            body_id=part.body_id,
            human_part=part.name,
            mode=mode,
        )

    def _arrays(
        self, parts: Sequence[Part], predictions: Mapping[tuple[str, str], ArmPrediction]
    ) -> PartArrays:
        """All parts as arrays for the kernel."""
        config = self._distance
        used: Mapping[int, ArmPrediction] = {}
        if config.human == PREDICTED:
            used, self.disbelieved = believed(parts, predictions, config, self._par)
        instants = max((len(p.times_s) for p in used.values()), default=1)
        arrays = self._buffers
        if arrays is None or arrays.times.shape != (len(parts), instants):
            arrays = self._buffers = PartArrays.empty(len(parts), instants)
        arrays.modes[:] = MEASURED_MODE if config.human == MEASURED else ASSUMED_MODE
        for index, part in enumerate(parts):
            arrays.ends[index] = part.ends
            arrays.radii[index] = part.radius
            arrays.ages[index] = part.age_s + config.stamp_error
            arrays.speeds[index] = part.speeds
            arrays.spreads[index] = part.spreads
            arrays.half_windows[index] = part.half_window_s
            arrays.fastest[index] = config.arm_speed if part.arm else config.body_speed
        if used:
            arrays.times[:] = -np.inf
        for index, prediction in used.items():
            part, k = parts[index], len(prediction.times_s)
            ends = slice(part.limb, part.limb + 2)
            arrays.modes[index] = PREDICTED_MODE
            arrays.times[index, :k] = prediction.times_s
            arrays.means[index, :, :k] = prediction.mean[:, ends].transpose(1, 0, 2)
            arrays.covariances[index, :, :k] = prediction.covariance[:, ends].transpose(1, 0, 2, 3)
            arrays.aheads[index] = prediction.age_s - part.age_s
        return arrays


def parameter_vector(config: ProtectiveDistanceConfig) -> FloatArray:
    """The parameters as the kernels take them, see :mod:`travel`."""
    par = np.empty(PARAMETERS)
    par[REACTION] = config.reaction_time
    par[ROBOT_AGE] = config.stamp_error
    par[STOPPING] = config.stopping_time
    par[SETTLING] = config.settling_time
    par[ROBOT_ACCELERATION] = config.robot_acceleration
    par[START_SPEED] = config.robot_speed
    par[FIXED] = config.intrusion + config.sensor_error + config.robot_error
    par[HUMAN_ACCELERATION] = config.human_acceleration
    par[SPEED_ERROR] = config.speed_error
    par[NOISE] = NOISE_SIGMAS * config.sample_noise
    par[EVASION] = float(config.evasion)
    par[CONTACT_SPEED] = config.contact_speed
    par[SIGMAS] = config.prediction_sigmas
    return par
