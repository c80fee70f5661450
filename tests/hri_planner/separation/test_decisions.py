"""What must hold for the monitor's decisions as a whole, whoever is where and however the robot moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.robot import load_robot
from hri_planner.separation.config import (
    ASSUMED,
    HUMAN_MODES,
    MEASURED,
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.monitor import ArmPrediction, SeparationMonitor, State
from hri_planner.separation.parts import SeenArm
from hri_planner.separation.robot_state import RobotState
from hri_planner.warm import warm_separation

warm_separation()
ROBOT = load_robot()
MS = 1_000_000
SEEDS = st.integers(0, 10**6)


def draw_robot(rng: np.random.Generator, rate: float = 1.0) -> RobotState:
    q = rng.uniform(ROBOT.lower, ROBOT.upper)
    return RobotState(q, rng.normal(0.0, 0.5, 7) * rate, float(rng.uniform(0.0, 0.02)), rate)


def draw_people(rng: np.random.Generator, count: int) -> dict[str, list[SeenArm]]:
    found = {}
    for number in range(count):
        shoulder = rng.uniform((-1.0, -1.0, 0.0), (1.0, 1.0, 0.8))
        steps = rng.normal(0.0, 0.15, (3, 3))
        points = np.concatenate((shoulder[None], shoulder + steps.cumsum(axis=0)))
        speeds = rng.normal(0.0, 0.7, (4, 3))
        ages = rng.uniform(0.0, 0.05, 4)
        found[f"p{number}"] = [SeenArm("right", points, ages, speeds, np.zeros(4), 0.024)]
    return found


Predictions = dict[tuple[str, str], ArmPrediction]


def draw_predictions(
    rng: np.random.Generator, people: dict[str, list[SeenArm]], human: str, age: float = 0.0
) -> Predictions:
    """What is predicted of them, where that counts: they go on about as they are seen to, or rest."""
    found: Predictions = {}
    if human != PREDICTED:
        return found
    times = np.linspace(0.0, 0.6, 13)
    for who, arms in people.items():
        for arm in arms:
            share = rng.uniform(0.0, 1.0)
            mean = arm.keypoints + times[:, None, None] * share * arm.speeds
            sds = rng.uniform(0.0, 0.02) * (1.0 + times / times[-1])
            covariance = np.multiply.outer(sds**2, np.tile(np.eye(3), (4, 1, 1)))
            newest = float(arm.age_s.min()) + age
            found[who, arm.side] = ArmPrediction(newest, times, mean, covariance)
    return found


def made(human: str = ASSUMED, *, let_go: bool = True, **distance: float) -> SeparationMonitor:
    monitor = SeparationMonitor(
        ROBOT,
        ProtectiveDistanceConfig(human=human, **distance),  # type: ignore[arg-type]
        BodyConfig(trunk=False),
        ReleaseConfig(),
    )
    if let_go:  # at full speed, with nobody there
        still = RobotState(np.zeros(7), np.zeros(7), 0.0, 1.0)
        for ms in (0, 400):
            monitor.decide(ms * MS, still, {})
    return monitor


@given(SEEDS, st.integers(1, 3), st.sampled_from(HUMAN_MODES))
@settings(max_examples=150, deadline=None)
def test_what_is_commanded_keeps_the_protective_distance(seed: int, count: int, human: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, count)
    said = draw_predictions(rng, people, human)
    verdict = made(human).decide(404 * MS, robot, people, said)
    assert 0.0 <= verdict.scale <= 1.0
    assert (verdict.state == State.FREE) == (verdict.scale == 1.0)
    assert (verdict.state == State.STOPPED) == (verdict.scale == 0.0)
    assert bool(verdict.reason) == (verdict.state != State.FREE)
    if verdict.scale > 0.1:  # slower, the speed at which it might set out counts
        slower = replace(robot, qd=robot.qd * verdict.scale, rate=verdict.scale)
        at_it = made(human).decide(404 * MS, slower, people, said)
        assert at_it.protective <= at_it.distance + 1e-9


@given(SEEDS, st.sampled_from(HUMAN_MODES))
@settings(max_examples=100, deadline=None)
def test_one_more_person_never_makes_it_faster(seed: int, human: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 3)
    said = draw_predictions(rng, people, human)
    fewer = {name: arms for name, arms in people.items() if name != "p2"}
    alone, together = (
        made(human).decide(404 * MS, robot, who, said).scale for who in (fewer, people)
    )
    assert together <= alone


@given(SEEDS, st.floats(0.001, 0.05), st.sampled_from([MEASURED, PREDICTED]))
@settings(max_examples=100, deadline=None)
def test_what_is_known_later_never_makes_it_faster(seed: int, later: float, human: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    older = {
        who: [replace(arm, age_s=arm.age_s + later) for arm in arms] for who, arms in people.items()
    }
    late = replace(robot, age_s=robot.age_s + later)
    said, older_said = (
        draw_predictions(np.random.default_rng(seed), people, human, age) for age in (0.0, later)
    )
    scales = [
        made(human).decide(404 * MS, state, who, predicted).scale
        for state, who, predicted in (
            (robot, people, said),
            (robot, older, older_said),
            (late, people, said),
        )
    ]
    assert scales[1] <= scales[0]
    assert scales[2] <= scales[0]


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_a_prediction_that_they_rest_is_no_promise(seed: int) -> None:
    """However sure it is: they may begin to reach as suddenly as people who are only measured."""
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    people = {
        who: [replace(arm, speeds=np.zeros((4, 3))) for arm in arms] for who, arms in people.items()
    }
    times = np.linspace(0.0, 0.6, 13)
    rests = {
        (who, arm.side): ArmPrediction(
            float(arm.age_s.min()),
            times,
            np.tile(arm.keypoints, (13, 1, 1)),
            np.zeros((13, 4, 3, 3)),
        )
        for who, arms in people.items()
        for arm in arms
    }
    predicted = made(PREDICTED).decide(404 * MS, robot, people, rests)
    measured = made(MEASURED, speed_error=0.0, sample_noise=0.0).decide(404 * MS, robot, people)
    assert predicted.scale <= measured.scale + 1e-9


def moved(said: Predictions, offsets: dict[tuple[str, str], np.ndarray]) -> Predictions:
    """Predictions of the same, elsewhere."""
    return {who: replace(one, mean=one.mean + offsets[who]) for who, one in said.items()}


@given(SEEDS, st.floats(0.12, 3.0), st.floats(0.0, 0.03))
@settings(max_examples=100, deadline=None)
def test_a_prediction_of_elsewhere_says_nothing(seed: int, far: float, older: float) -> None:
    """As far off as its own spread and what people may do otherwise cannot explain."""
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    people = {
        who: [replace(arm, age_s=np.full(4, 0.02), speeds=np.zeros((4, 3))) for arm in arms]
        for who, arms in people.items()
    }
    said = draw_predictions(rng, people, PREDICTED, older)
    offsets = {}
    for who in said:
        way = rng.normal(size=3)
        offsets[who] = far * way / np.linalg.norm(way)
    monitor = made(PREDICTED)
    found = monitor.decide(404 * MS, robot, people, moved(said, offsets))
    assert monitor.disbelieved == set(said)
    assert found == made(PREDICTED).decide(404 * MS, robot, people, {})
    # One that is right is believed beside it, and believed again.
    (wrong, _) = offsets
    half = {who: offset * (who == wrong) for who, offset in offsets.items()}
    monitor.decide(404 * MS, robot, people, moved(said, half))
    assert monitor.disbelieved == {wrong}
    monitor.decide(404 * MS, None, people, moved(said, half), trouble="no robot")
    assert monitor.disbelieved == frozenset()
    monitor.decide(404 * MS, robot, people, moved(said, half))
    monitor.decide(404 * MS, robot, people, said)
    assert monitor.disbelieved == frozenset()


@given(SEEDS, st.floats(0.0, 0.1), st.floats(0.0, 1.0))
@settings(max_examples=100, deadline=None)
def test_whoever_does_otherwise_as_is_reckoned_with_is_believed(
    seed: int, older: float, share: float
) -> None:
    """Seen with its errors, off by what they began since the prediction's samples."""
    rng = np.random.default_rng(seed)
    config = ProtectiveDistanceConfig()
    people = draw_people(rng, 1)
    (arm,) = people["p0"]
    ages = np.array([0.01, 0.01, 0.01, rng.uniform(0.01, 0.15)])  # the tip may be hidden for longer
    people = {"p0": [replace(arm, age_s=ages)]}
    said = draw_predictions(rng, people, PREDICTED, older)
    (one,) = said.values()
    since = one.age_s - ages
    began = np.maximum(since, 0.0)
    own = config.human_acceleration * began * (0.024 + 0.5 * began)
    gone = config.arm_speed * np.maximum(-since, 0.0)
    sds = np.sqrt([np.interp(s, one.times_s, one.covariance[:, 0, 0, 0]) for s in since])
    least = config.sensor_error + own + gone + config.prediction_sigmas * sds
    way = rng.normal(size=(4, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    # Where they are predicted to be by now, and as far from there as that.
    by_now = np.stack(
        [
            [np.interp(s, one.times_s, one.mean[:, k, axis]) for axis in range(3)]
            for k, s in enumerate(since)
        ]
    )
    seen = replace(people["p0"][0], keypoints=by_now + share * least[:, None] * way)
    monitor = made(PREDICTED)
    monitor.decide(404 * MS, draw_robot(rng), {"p0": [seen]}, said)
    assert monitor.disbelieved == frozenset()


@given(SEEDS, st.floats(0.0, 0.016))
@settings(max_examples=100, deadline=None)
def test_nobody_is_taken_to_be_farther_away_than_they_are_seen(seed: int, off: float) -> None:
    """By a prediction that is off by so little that it is believed."""
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    said = draw_predictions(rng, people, PREDICTED)
    offsets = {}
    for who in said:
        way = rng.normal(size=3)
        offsets[who] = off * way / np.linalg.norm(way)
    monitor = made(PREDICTED)
    found = monitor.decide(404 * MS, robot, people, moved(said, offsets))
    assert monitor.disbelieved == frozenset()
    assert found.scale <= made(PREDICTED).decide(404 * MS, robot, people, said).scale


@given(SEEDS)
@settings(max_examples=100, deadline=None)
def test_who_is_measured_never_counts_for_more_than_who_is_assumed(seed: int) -> None:
    """Assumed to be as fast as they are seen to be, where that is more than the standard says."""
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    seen = max(np.linalg.norm(arm.speeds, axis=-1).max() for p in people.values() for arm in p)
    fastest = max(float(seen), ProtectiveDistanceConfig().arm_speed)
    assumed = made(ASSUMED, arm_speed=fastest).decide(404 * MS, robot, people)
    measured = made(MEASURED).decide(404 * MS, robot, people)
    assert measured.scale >= assumed.scale


@given(SEEDS, st.sampled_from(["intrusion", "sensor_error", "robot_error", "reaction_time"]))
@settings(max_examples=100, deadline=None)
def test_more_caution_never_makes_it_faster(seed: int, term: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 1)
    usual = getattr(ProtectiveDistanceConfig(), term)
    one, other = (
        made(**{term: value}).decide(404 * MS, robot, people) for value in (usual, usual + 0.04)
    )
    assert other.scale <= one.scale


@given(SEEDS, st.lists(st.sampled_from(["nobody", "people", "unknown", "blind"]), max_size=60))
@settings(max_examples=60, deadline=None)
def test_a_stop_lasts_until_there_was_room_for_a_while(seed: int, course: list[str]) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 1)
    monitor, room_since_ms = made(let_go=False), None
    wait_ms = 1000.0 * ReleaseConfig().release_time
    for step, what in enumerate(course, start=1):
        who = {"nobody": {}, "blind": {"p0": []}}.get(what, people)
        verdict = monitor.decide(8 * step * MS, None if what == "unknown" else robot, who)
        if what in ("unknown", "blind"):
            assert verdict.state == State.STOPPED
            room_since_ms = None
        elif what == "nobody":
            room_since_ms = 8 * step if room_since_ms is None else room_since_ms
            assert (verdict.state == State.FREE) == (8 * step - room_since_ms >= wait_ms)
        elif verdict.state == State.STOPPED and not verdict.reason.startswith("room again"):
            room_since_ms = None
        elif room_since_ms is None:
            room_since_ms = 8 * step
            assert verdict.state == State.STOPPED
