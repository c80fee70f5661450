"""The law of the monitor in a loop: robot and person on one line, with all delays that it reckons with."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from hypothesis import given, settings, target
from hypothesis import strategies as st

from hri_planner.separation import travel
from hri_planner.separation.config import ASSUMED, MEASURED, ProtectiveDistanceConfig
from hri_planner.separation.monitor import parameter_vector
from hri_planner.separation.robot_state import LEAST_RATE
from hri_planner.warm import warm_separation

NOTHING = (np.full(1, -np.inf), np.zeros((2, 1, 3)), np.zeros((2, 1, 3, 3)), np.zeros(2))
ALONG_X = np.array([1.0, 0.0, 0.0])
MODES = {ASSUMED: travel.ASSUMED_MODE, MEASURED: travel.MEASURED_MODE}
STEP = 0.004
REACTION_STEPS = 4  # 16 ms, and up to a step until it is looked at: the reaction time
CAPTURE_STEPS = 3
LAG_S = 0.02  # the arm follows its reference: after the settling time 3 % are left
RAMP_UP_S = 0.5
STRETCH_S = 0.1  # for so long an acceleration stays the same
RESTS = 0.02
warm_separation()  # hypothesis takes the compiler's time for that of a test

extremes = st.sampled_from((-1.0, 1.0, 1.0))
shares = st.lists(extremes | st.floats(-1.0, 1.0), min_size=1, max_size=12)


class Robot:
    """Follows its path along a line at the rate that it is given.

    Args:
        config: What the rate is decided by.
        accelerations: Of the path, as shares of the largest, one for each stretch of it.
        speed: Of the path at first [m/s].
        fastest: The path is never faster [m/s].
    """

    def __init__(
        self,
        config: ProtectiveDistanceConfig,
        accelerations: list[float],
        speed: float,
        fastest: float = 1.0,
    ) -> None:
        self._par, self._config = parameter_vector(config), config
        self._accelerations = accelerations
        self._path_speed, self._path_time, self._fastest = speed, 0.0, fastest
        self._seen_speed = -1.0
        self._commands = [0.0] * REACTION_STEPS
        self._rates = deque([0.0], maxlen=1 + round(config.settling_time / STEP))
        self.rate, self.speed, self.way = 0.0, 0.0, 0.0

    def step(self, scale: float) -> None:
        """One control period with a newly commanded rate, which counts a reaction time later."""
        config = self._config
        self._commands.append(scale)
        change = self._commands.pop(0) - self.rate
        self.rate += min(max(change, -STEP / config.stopping_time), STEP / RAMP_UP_S)
        self._rates.append(self.rate)
        share = self._accelerations[int(self._path_time / STRETCH_S) % len(self._accelerations)]
        gained = config.robot_acceleration * share * self.rate * STEP
        fastest = self._fastest
        self._seen_speed = abs(self._path_speed) if self.rate >= LEAST_RATE else -1.0
        self._path_speed = min(max(self._path_speed + gained, -fastest), fastest)
        self._path_time += self.rate * STEP
        self.speed += (self._path_speed * self.rate - self.speed) * (1.0 - math.exp(-STEP / LAG_S))
        self.way += self.speed * STEP

    def allowed(self, gap: float, human: float) -> float:
        """Rate that somebody in front allows, who was seen a gap away at a speed."""
        return travel.allowed_scale(
            gap, self.speed, min(self._rates), self._seen_speed, np.zeros((2, 3)),
            np.full(2, CAPTURE_STEPS * STEP), np.tile(human * ALONG_X, (2, 1)), np.zeros(2), 0.0,
            self._config.arm_speed, MODES[self._config.human], ALONG_X, *NOTHING, self._par,
            np.empty(travel.TERMS),
        )  # fmt: skip

    def harmless(self) -> float:
        """Rate that is harmless."""
        return travel.harmless_scale(abs(self.speed), min(self._rates), self._seen_speed, self._par)


@settings(max_examples=200, deadline=None)
@given(
    shares,
    shares,
    st.floats(-1.0, 1.0),
    st.floats(1.0, 2.5),
    st.floats(0.02, 1.5),
    st.sampled_from(sorted(MODES)),
)
def test_nobody_is_touched_by_a_robot_that_moves(
    accelerations: list[float],
    pushes: list[float],
    speed: float,
    fastest: float,
    gap: float,
    human: str,
) -> None:
    config = ProtectiveDistanceConfig(human=human, intrusion=0.0, sensor_error=0.0, robot_error=0.0)
    robot = Robot(config, accelerations, speed * fastest, fastest)
    person, theirs = -gap, 0.0
    seen = [(person, theirs)] * CAPTURE_STEPS
    nearest = gap
    for step in range(500):
        share = pushes[int(step * STEP / STRETCH_S) % len(pushes)]
        if human == MEASURED:
            theirs += config.human_acceleration * share * STEP
            theirs = min(max(theirs, -config.arm_speed), config.arm_speed)
        else:
            theirs = share * config.arm_speed
        person += theirs * STEP
        if abs(robot.speed) > RESTS:
            nearest = min(nearest, -robot.way - person)
        if person >= -robot.way:
            break
        seen.append((person, theirs))
        place, rate = seen.pop(0)
        robot.step(robot.allowed(-robot.way - place, rate))
    target(-nearest, label="how near to a robot that moves")
    assert nearest > 0.0


@settings(max_examples=200, deadline=None)
@given(shares, st.floats(-1.0, 1.0), st.floats(1.0, 2.5))
def test_beside_somebody_the_robot_stays_harmless(
    accelerations: list[float], speed: float, fastest_path: float
) -> None:
    """Of paths, too, that are so fast that what is harmless of them is too slow to be measured."""
    config = ProtectiveDistanceConfig(contact_speed=0.15)
    robot = Robot(config, accelerations, speed * fastest_path, fastest_path)
    fastest = 0.0
    for _ in range(500):
        robot.step(robot.harmless())
        fastest = max(fastest, abs(robot.speed))
    target(fastest, label="speed beside somebody")
    assert fastest <= config.contact_speed + 0.01
