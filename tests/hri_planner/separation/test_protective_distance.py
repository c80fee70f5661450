"""The protective distance: its terms against integration, and the speed that it allows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.separation import travel
from hri_planner.separation.config import ProtectiveDistanceConfig
from hri_planner.separation.monitor import parameter_vector
from hri_planner.warm import warm_separation
from hri_prediction.errors import ConfigError

CONFIG = ProtectiveDistanceConfig()
PAR = parameter_vector(CONFIG)
NOTHING = (np.full(1, -np.inf), np.zeros((2, 1, 3)), np.zeros((2, 1, 3, 3)), np.zeros(2))
warm_separation()  # hypothesis takes the compiler's time for that of a test
ALONG_X = np.array([1.0, 0.0, 0.0])


def person(
    mode: int = travel.ASSUMED_MODE,
    age: float = 0.01,
    speed: float = math.nan,
    fastest: float = 2.0,
    outward: np.ndarray = ALONG_X,
    prediction: tuple = NOTHING,
    spread: float = 0.0,
) -> tuple:
    """Arguments of a part whose ends are at the origin."""
    speeds = np.full((2, 3), math.nan) if math.isnan(speed) else np.tile(speed * ALONG_X, (2, 1))
    return (
        np.zeros((2, 3)),
        np.full(2, age),
        speeds,
        np.full(2, spread),
        0.024,
        fastest,
        mode,
        outward,
        *prediction,
    )


def needed(scale: float, rate: float, toward: float, who: tuple, path_speed: float = -1.0) -> float:
    terms = np.empty(travel.TERMS)
    seconds = CONFIG.reaction_time + CONFIG.stopping_time * scale + CONFIG.settling_time
    robot = travel.robot_travel(toward, rate, path_speed, scale, PAR, terms)
    return robot + travel.human_travel(seconds, *who, PAR, terms) + PAR[travel.FIXED]


@pytest.mark.parametrize("scale", [0.2, 0.6, 1.0])
@pytest.mark.parametrize("toward", [-0.5, 0.0, 0.7])
def test_the_robot_stops_within_its_terms(scale: float, toward: float) -> None:
    """Against a step by step account of the worst: it speeds up till the stop, and along the ramp."""
    terms = np.empty(travel.TERMS)
    total = travel.robot_travel(toward, 1.0, -1.0, scale, PAR, terms)
    dt, way, time, path = 1e-5, 0.0, 0.0, toward * scale
    reaction, stop = PAR[travel.REACTION] + PAR[travel.ROBOT_AGE], CONFIG.stopping_time * scale
    while time < reaction + stop:
        path += CONFIG.robot_acceleration * scale**2 * dt
        share = 1.0 if time < reaction else 1.0 - (time - reaction) / stop
        way += path * share * dt
        time += dt
    assert way <= total + 1e-4
    if toward > 0.0:
        gained = CONFIG.robot_acceleration * reaction
        assert total <= way + (toward * scale + gained) * CONFIG.settling_time + 0.005
    assert terms[travel.S_R] >= 0.0
    assert terms[travel.S_S] >= 0.0


def test_an_assumed_person_comes_at_the_speed_of_the_standard() -> None:
    terms = np.empty(travel.TERMS)
    assert travel.human_travel(0.13, *person(age=0.02), PAR, terms) == pytest.approx(2.0 * 0.15)
    assert terms[travel.HUMAN_SPEED] == pytest.approx(2.0)


@given(
    speed=st.floats(-6.0, 6.0),
    age=st.floats(0.0, 0.1),
    seconds=st.floats(0.0, 0.3),
)
def test_a_measured_person_comes_no_farther_than_an_assumed_one_or_as_they_are_seen_to(
    speed: float, age: float, seconds: float
) -> None:
    terms = np.empty(travel.TERMS)
    measured = person(travel.MEASURED_MODE, age, speed)
    way = travel.human_travel(seconds, *measured, PAR, terms)
    span = seconds + age
    # Beyond its error a measured speed is true, whatever is assumed.
    fastest = max(2.0, speed - CONFIG.speed_error)
    assert 0.0 <= way <= fastest * span + 1e-12
    # Whoever has that speed in the middle of the window and then accelerates as is reckoned with.
    worst = speed * span + CONFIG.human_acceleration * span * (0.024 + 0.5 * span)
    assert way >= min(worst, fastest * span) - 1e-12


@given(speed=st.floats(-2.0, 2.0), spread=st.floats(0.0, 500.0))
def test_a_speed_through_few_samples_says_little(speed: float, spread: float) -> None:
    """As after a gap: three standard deviations of what noise makes of it are reckoned with."""
    terms = np.empty(travel.TERMS)
    way = travel.human_travel(
        0.1, *person(travel.MEASURED_MODE, 0.0, speed, spread=spread), PAR, terms
    )
    error = max(CONFIG.speed_error, 3.0 * CONFIG.sample_noise * spread)
    worst = (speed + error) * 0.1 + CONFIG.human_acceleration * 0.1 * (0.024 + 0.05)
    assert way == pytest.approx(min(max(worst, 0.0), 2.0 * 0.1))


def test_a_speed_that_is_not_known_is_the_assumed_one() -> None:
    terms = np.empty(travel.TERMS)
    unknown = travel.human_travel(0.1, *person(travel.MEASURED_MODE), PAR, terms)
    assert unknown == pytest.approx(2.0 * 0.11)


def prediction(speed: float, sigma: float, last: float, older: float = 0.0) -> tuple:
    """Both ends go along x at a speed from the origin."""
    times = np.linspace(0.0, last, 11)
    mean = np.zeros((2, 11, 3))
    mean[:, :, 0] = speed * times
    covariance = np.tile(sigma**2 * np.eye(3), (2, 11, 1, 1))
    return times, mean, covariance, np.full(2, older)


def own_way(seconds: float, half_window: float = 0.024) -> float:
    """How far people go beyond what is predicted, by what they began since they were seen."""
    return CONFIG.human_acceleration * seconds * (half_window + 0.5 * seconds)


def test_a_predicted_person_comes_as_far_as_predicted_and_as_they_may_do_otherwise() -> None:
    terms = np.empty(travel.TERMS)
    who = person(travel.PREDICTED_MODE, 0.0, 0.0, prediction=prediction(0.5, 0.01, 1.0))
    way = travel.human_travel(0.2, *who, PAR, terms)
    assert way == pytest.approx(0.5 * 0.2 + 3.0 * 0.01 + own_way(0.2))
    # Of an older prediction, later instants count.
    who = person(travel.PREDICTED_MODE, 0.0, 0.0, prediction=prediction(0.5, 0.01, 1.0, 0.1))
    way = travel.human_travel(0.2, *who, PAR, terms)
    assert way == pytest.approx(min(0.5 * 0.3 + 3.0 * 0.01 + own_way(0.3), 2.0 * 0.2))


def test_a_hand_that_is_predicted_to_rest_may_reach_out_all_the_same() -> None:
    """Predicted to rest with no spread at all, as who has rested for long: as if that were not known."""
    terms = np.empty(travel.TERMS)
    resting = person(travel.PREDICTED_MODE, 0.02, 0.0, prediction=prediction(0.0, 0.0, 1.0))
    way = travel.human_travel(0.15, *resting, PAR, terms)
    measured = person(travel.MEASURED_MODE, 0.02, 0.0)
    by_speed = travel.human_travel(0.15, *measured, PAR, terms)
    assert way == pytest.approx(own_way(0.17))
    assert way == pytest.approx(by_speed - CONFIG.speed_error * 0.17)


@given(
    arrays(float, (2, 11), elements=st.floats(-0.1, 0.1)),
    st.floats(0.0, 0.03),
    st.floats(0.02, 0.3),
    st.floats(0.0, 0.1),
    st.integers(2, 7),
)
def test_between_its_instants_a_prediction_goes_straight(
    places: np.ndarray, sigma: float, seconds: float, older: float, parts: int
) -> None:
    """One that says the same at more instants allows the same: hands may turn back in between."""
    times = np.linspace(0.0, 0.5, 11)
    finer = np.linspace(0.0, 0.5, 10 * parts + 1)
    ways = []
    for instants in (times, finer):
        mean = np.zeros((2, len(instants), 3))
        mean[:, :, 0] = [np.interp(instants, times, one) for one in places]
        covariance = np.tile(sigma**2 * np.eye(3), (2, len(instants), 1, 1))
        said = (instants, mean, covariance, np.full(2, older))
        who = person(travel.PREDICTED_MODE, 0.0, 0.0, prediction=said)
        ways.append(travel.human_travel(seconds, *who, PAR, np.empty(travel.TERMS)))
    assert ways[0] == pytest.approx(ways[1], abs=1e-9)


def test_a_prediction_that_ends_too_early_says_nothing() -> None:
    terms = np.empty(travel.TERMS)
    who = person(travel.PREDICTED_MODE, 0.0, 0.0, prediction=prediction(0.1, 0.0, 0.1))
    assert travel.human_travel(0.2, *who, PAR, terms) == pytest.approx(2.0 * 0.2)


def test_whoever_is_seen_to_come_is_not_predicted_to_rest() -> None:
    """A wrong prediction, or one of a dead predictor, never lets a hand come nearer than it may."""
    terms = np.empty(travel.TERMS)
    resting = prediction(0.0, 0.001, 1.0)
    coming = person(travel.PREDICTED_MODE, 0.0, 1.5, prediction=resting)
    way = travel.human_travel(0.2, *coming, PAR, terms)
    assert way == pytest.approx(2.0 * 0.2)  # it speeds up, to what is assumed
    coming = person(travel.PREDICTED_MODE, 0.0, 0.7, prediction=resting)
    assert travel.human_travel(0.1, *coming, PAR, terms) == pytest.approx(0.7 * 0.1 + own_way(0.1))
    # Faster than is assumed: as far as that is certain.
    rushing = person(travel.PREDICTED_MODE, 0.0, 3.0, prediction=resting)
    way = travel.human_travel(0.2, *rushing, PAR, terms)
    assert way == pytest.approx((3.0 - CONFIG.speed_error) * 0.2)
    # One whose speed is not known yet counts as assumed.
    unknown = person(travel.PREDICTED_MODE, 0.0, prediction=resting)
    assert travel.human_travel(0.2, *unknown, PAR, terms) == pytest.approx(2.0 * 0.2)


@given(
    distance=st.floats(-0.5, 2.0),
    toward=st.floats(-2.0, 2.0),
    rate=st.floats(0.0, 1.0),
    path_speed=st.floats(0.0, 2.5),
    mode=st.sampled_from([travel.ASSUMED_MODE, travel.MEASURED_MODE]),
    speed=st.floats(-4.0, 4.0),
)
def test_the_allowed_speed_keeps_the_protective_distance(
    distance: float, toward: float, rate: float, path_speed: float, mode: int, speed: float
) -> None:
    who = person(mode, 0.01, speed)
    terms = np.empty(travel.TERMS)
    scale = travel.allowed_scale(distance, toward, rate, path_speed, *who, PAR, terms)
    assert 0.0 <= scale <= 1.0
    if scale > 0.0:
        assert needed(scale, rate, toward, who, path_speed) <= distance
    if scale < 1.0:
        assert needed(min(scale + 0.002, 1.0), rate, toward, who, path_speed) > distance
    # More room never means less speed.
    more = travel.allowed_scale(distance + 0.05, toward, rate, path_speed, *who, PAR, terms)
    assert more >= scale
    # A faster path never means more speed.
    faster = travel.allowed_scale(distance, toward, rate, path_speed + 0.5, *who, PAR, terms)
    assert faster <= scale


@given(distance=st.floats(-0.5, 1.0), toward=st.floats(-2.0, 2.0), rate=st.floats(0.1, 1.0))
def test_who_is_evaded_counts_not_but_the_way_back_does(
    distance: float, toward: float, rate: float
) -> None:
    """A part that leaves may turn round: it has room for that, whatever the person does."""
    par = parameter_vector(ProtectiveDistanceConfig(evasion=True))
    terms = np.empty(travel.TERMS)
    rushing = person(travel.MEASURED_MODE, 0.05, 2.0)
    scale = travel.allowed_scale(distance, toward, rate, -1.0, *rushing, par, terms)
    if toward >= travel.AWAY:
        assert scale == travel.allowed_scale(distance, toward, rate, -1.0, *rushing, PAR, terms)
        return
    own = travel.robot_travel(toward, rate, -1.0, scale, par, terms) + par[travel.FIXED]
    assert scale == 0.0 or own <= distance
    if distance > par[travel.FIXED] + 0.1:
        assert scale == 1.0


@pytest.mark.parametrize("place", range(5))
def test_nan_allows_nothing(place: int) -> None:
    terms = np.empty(travel.TERMS)
    values = [1.0, 0.1, 1.0, 0.5]
    who = list(person())
    if place < 4:
        values[place] = math.nan
    else:
        who[1] = np.full(2, math.nan)
    assert travel.allowed_scale(*values, *who, PAR, terms) == 0.0


def test_a_mode_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigError, match="assumed, measured, predicted"):
        ProtectiveDistanceConfig(human="guessed")
