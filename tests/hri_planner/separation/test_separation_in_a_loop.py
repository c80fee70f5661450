"""The law of the monitor in a loop: robot and person on one line, with all delays that it reckons with."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from itertools import cycle, product

import numpy as np
import pytest
from hypothesis import given, settings, target
from hypothesis import strategies as st

from hri_planner.separation import travel
from hri_planner.separation.config import (
    ASSUMED,
    HUMAN_MODES,
    MEASURED,
    PREDICTED,
    ProtectiveDistanceConfig,
)
from hri_planner.separation.monitor import parameter_vector
from hri_planner.separation.robot_state import LEAST_RATE
from hri_planner.separation.timely import MOST_HELD_S, is_timely
from hri_planner.warm import warm_separation

ALONG_X = np.array([1.0, 0.0, 0.0])
MODES = {
    ASSUMED: travel.ASSUMED_MODE,
    MEASURED: travel.MEASURED_MODE,
    PREDICTED: travel.PREDICTED_MODE,
}
STEP = 0.004
# All but two steps of the reaction time: up to a step until it is looked at, and one that begins to slow.
REACTION_STEPS = round(ProtectiveDistanceConfig().reaction_time / STEP) - 2
# The same in parts: what the monitor says is two steps on its way, and good for eight of them.
TRANSPORT_STEPS, HEARTBEAT_STEPS = 2, 8
TIMES = np.linspace(0.0, 0.6, 31)
CAPTURE_STEPS = 3
LAG_S = 0.02  # the arm follows its reference: after the settling time 3 % are left
RAMP_UP_S = 0.5
STRETCH_S = 0.1  # for so long an acceleration stays the same
RESTS = 0.02
LITTLE = 1e-3
warm_separation()  # hypothesis takes the compiler's time for that of a test

extremes = st.sampled_from((-1.0, 1.0, 1.0))
shares = st.lists(extremes | st.floats(-1.0, 1.0), min_size=1, max_size=12)


class Robot:
    """Follows its path along a line at the rate that it is given.

    Its joints are seen as they were a step ago, with stamps that say now.

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
        self.seen_way, self._seen_toward = 0.0, 0.0

    def step(self, scale: float) -> None:
        """One control period with a newly commanded rate, which counts a reaction time later."""
        config = self._config
        self.seen_way, self._seen_toward = self.way, self.speed
        change = self._commanded(scale) - self.rate
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

    def _commanded(self, scale: float) -> float:
        """Rate that the controller heeds now, if one is decided on now."""
        self._commands.append(scale)
        return self._commands.pop(0)

    def leave_out(self, term: int) -> None:
        """The monitor no longer reckons with a term, one of the places of :mod:`travel`."""
        self._par[term] = LITTLE

    def allowed(self, gap: float, human: float, predicted: float = 0.0) -> float:
        """Rate that somebody in front allows, who was seen a gap away at a speed.

        With predictions, these say how their speed changes until they rest [m/s²], and that for certain.
        """
        mean = np.zeros((2, len(TIMES), 3))
        slowing = np.minimum(TIMES, max(human, 0.0) / predicted) if predicted > 0.0 else TIMES
        mean[:, :, 0] = (
            human * TIMES if predicted <= 0.0 else slowing * (human - 0.5 * predicted * slowing)
        )
        said = (TIMES, mean, np.zeros((2, len(TIMES), 3, 3)), np.zeros(2))
        return travel.allowed_scale(
            gap, self._seen_toward, min(self._rates), self._seen_speed, np.zeros((2, 3)),
            np.full(2, CAPTURE_STEPS * STEP), np.tile(human * ALONG_X, (2, 1)), np.zeros(2), 0.0,
            self._config.arm_speed, MODES[self._config.human], ALONG_X, *said, self._par,
            np.empty(travel.TERMS),
        )  # fmt: skip

    def harmless(self) -> float:
        """Rate that is harmless."""
        return travel.harmless_scale(
            abs(self._seen_toward), min(self._rates), self._seen_speed, self._par
        )


class HeldUp(Robot):
    """One whose monitor is held up between reading the time and saying what it decided.

    Args:
        config: See :class:`Robot`.
        accelerations: See :class:`Robot`.
        speed: See :class:`Robot`.
        fastest: See :class:`Robot`.
        holds: For how many steps, decision by decision.
        timely: Which decisions it says.
    """

    def __init__(
        self,
        config: ProtectiveDistanceConfig,
        accelerations: list[float],
        speed: float,
        fastest: float,
        holds: list[int],
        timely: Callable[[float, float], bool] = is_timely,
    ) -> None:
        super().__init__(config, accelerations, speed, fastest)
        self._holds, self._timely = cycle(holds), timely
        self._decided, self._hold, self._left = 0.0, 0, -1
        self._said: list[float | None] = [None] * TRANSPORT_STEPS
        self._heard, self._silent = 0.0, 0

    def _commanded(self, scale: float) -> float:
        self._left -= 1
        if self._left < 0:
            self._decided = scale
            self._hold = self._left = next(self._holds)
        said = self._left == 0 and self._timely(self._decided, self._hold * STEP)
        self._said.append(self._decided if said else None)
        heard = self._said.pop(0)
        self._silent += 1
        if heard is not None:
            self._heard, self._silent = heard, 0
        return self._heard if self._silent < HEARTBEAT_STEPS else 0.0


def nearest(
    robot: Robot,
    human: str,
    pushes: list[float],
    gap: float,
    predicted: float,
) -> float:
    """How near somebody comes to the robot while that moves [m]; not above 0: they touch.

    Args:
        robot: Comes along the line.
        human: How it is reckoned with them.
        pushes: What they do, as shares of the largest acceleration (or of the speed that is assumed), for
            one stretch of time each.
        gap: Between them at first [m].
        predicted: How they are predicted to slow down [m/s²].
    """
    config = ProtectiveDistanceConfig()
    person, theirs, least = -gap, 0.0, gap
    seen = [(person, theirs)] * CAPTURE_STEPS
    for step in range(500):
        share = pushes[int(step * STEP / STRETCH_S) % len(pushes)]
        if human == ASSUMED:
            theirs = share * config.arm_speed
        else:
            # Of whom something is predicted, that is how far they are from it.
            slowing = predicted if human == PREDICTED and theirs > 0.0 else 0.0
            theirs += (config.human_acceleration * share - slowing) * STEP
            theirs = min(max(theirs, -config.arm_speed), config.arm_speed)
        person += theirs * STEP
        if abs(robot.speed) > RESTS:
            least = min(least, -robot.way - person)
        if person >= -robot.way:
            break
        seen.append((person, theirs))
        place, rate = seen.pop(0)
        robot.step(robot.allowed(-robot.seen_way - place, rate, predicted))
    return least


def config_of(human: str) -> ProtectiveDistanceConfig:
    return ProtectiveDistanceConfig(human=human, intrusion=0.0, sensor_error=0.0, robot_error=0.0)


@settings(max_examples=200, deadline=None)
@given(
    shares,
    shares,
    st.floats(-1.0, 1.0),
    st.floats(1.0, 2.5),
    st.floats(0.02, 1.5),
    st.floats(0.0, 7.0),
    st.sampled_from(HUMAN_MODES),
)
def test_nobody_is_touched_by_a_robot_that_moves(
    accelerations: list[float],
    pushes: list[float],
    speed: float,
    fastest: float,
    gap: float,
    predicted: float,
    human: str,
) -> None:
    """Whoever comes as fast as is assumed, or changes speed as is reckoned with, or by so much otherwise
    than is predicted."""
    robot = Robot(config_of(human), accelerations, speed * fastest, fastest)
    least = nearest(robot, human, pushes, gap, predicted)
    target(-least, label="how near to a robot that moves")
    assert least > 0.0


@pytest.mark.parametrize(
    ("human", "term"),
    [
        *product(HUMAN_MODES, [travel.REACTION, travel.STOPPING, travel.SETTLING]),
        (ASSUMED, travel.ROBOT_AGE),
        *product([MEASURED, PREDICTED], [travel.HUMAN_ACCELERATION]),
    ],
)
def test_without_a_term_somebody_is_touched(human: str, term: int) -> None:
    """So that the property above could fail."""
    rng = np.random.default_rng(0)
    for _ in range(4000):
        accelerations, pushes = (
            rng.choice([-1.0, 1.0, 1.0, rng.uniform(-1.0, 1.0)], rng.integers(1, 12)).tolist()
            for _ in range(2)
        )
        fastest = rng.uniform(1.0, 2.5)
        robot = Robot(config_of(human), accelerations, rng.uniform(-1.0, 1.0) * fastest, fastest)
        robot.leave_out(term)
        predicted = rng.choice([0.0, rng.uniform(0.0, 7.0)])
        if nearest(robot, human, pushes, rng.uniform(0.02, 1.5), predicted) <= 0.0:
            return
    pytest.fail("nobody was touched in 4,000 tries")


holds = st.lists(st.sampled_from((0, 1)) | st.integers(0, 25), min_size=1, max_size=40) | st.lists(
    st.integers(2, 9), min_size=1, max_size=3
)


@settings(max_examples=200, deadline=None)
@given(
    shares, shares, st.floats(-1.0, 1.0), st.floats(1.0, 2.5), st.floats(0.02, 1.5), holds,
    st.sampled_from([ASSUMED, MEASURED]),
)  # fmt: skip
def test_nobody_is_touched_though_the_monitor_is_held_up(
    accelerations: list[float],
    pushes: list[float],
    speed: float,
    fastest: float,
    gap: float,
    holds: list[int],
    human: str,
) -> None:
    robot = HeldUp(config_of(human), accelerations, speed * fastest, fastest, holds)
    least = nearest(robot, human, pushes, gap, 0.0)
    target(-least, label="how near to a robot that moves")
    assert least > 0.0


@pytest.mark.parametrize("human", [ASSUMED, MEASURED])
def test_if_it_said_what_is_late_somebody_would_be(human: str) -> None:
    rng = np.random.default_rng(0)
    for _ in range(4000):
        accelerations, pushes = (
            rng.choice([-1.0, 1.0, 1.0, rng.uniform(-1.0, 1.0)], rng.integers(1, 12)).tolist()
            for _ in range(2)
        )
        fastest = rng.uniform(1.0, 2.5)
        held = [*([0] * int(rng.integers(0, 4))), int(rng.integers(4, 9))]
        robot = HeldUp(
            config_of(human), accelerations, rng.uniform(-1.0, 1.0) * fastest, fastest, held,
            lambda scale, held_s: True,
        )  # fmt: skip
        if nearest(robot, human, pushes, rng.uniform(0.02, 1.5), 0.0) <= 0.0:
            return
    pytest.fail("nobody was touched in 4,000 tries")


def test_what_is_late_is_a_stop_or_is_not_said() -> None:
    assert is_timely(1.0, MOST_HELD_S)
    assert not is_timely(0.01, 1.01 * MOST_HELD_S)
    assert is_timely(0.0, 60.0)


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
