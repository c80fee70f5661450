"""What must hold for the monitor's decisions as a whole, whoever is where and however the robot moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.robot import load_robot
from hri_planner.separation.config import (
    ASSUMED,
    MEASURED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.monitor import SeparationMonitor, State
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


@given(SEEDS, st.integers(1, 3), st.sampled_from([ASSUMED, MEASURED]))
@settings(max_examples=150, deadline=None)
def test_what_is_commanded_keeps_the_protective_distance(seed: int, count: int, human: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, count)
    verdict = made(human).decide(404 * MS, robot, people)
    assert 0.0 <= verdict.scale <= 1.0
    assert (verdict.state == State.FREE) == (verdict.scale == 1.0)
    assert (verdict.state == State.STOPPED) == (verdict.scale == 0.0)
    assert bool(verdict.reason) == (verdict.state != State.FREE)
    if verdict.scale > 0.1:  # slower, the speed at which it might set out counts
        slower = replace(robot, qd=robot.qd * verdict.scale, rate=verdict.scale)
        at_it = made(human).decide(404 * MS, slower, people)
        assert at_it.protective <= at_it.distance + 1e-9


@given(SEEDS, st.sampled_from([ASSUMED, MEASURED]))
@settings(max_examples=100, deadline=None)
def test_one_more_person_never_makes_it_faster(seed: int, human: str) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 3)
    fewer = {name: arms for name, arms in people.items() if name != "p2"}
    alone, together = (made(human).decide(404 * MS, robot, who).scale for who in (fewer, people))
    assert together <= alone


@given(SEEDS, st.floats(0.001, 0.05))
@settings(max_examples=100, deadline=None)
def test_what_is_known_later_never_makes_it_faster(seed: int, later: float) -> None:
    rng = np.random.default_rng(seed)
    robot, people = draw_robot(rng), draw_people(rng, 2)
    older = {
        who: [replace(arm, age_s=arm.age_s + later) for arm in arms] for who, arms in people.items()
    }
    late = replace(robot, age_s=robot.age_s + later)
    scales = [
        made(MEASURED).decide(404 * MS, state, who).scale
        for state, who in ((robot, people), (robot, older), (late, people))
    ]
    assert scales[1] <= scales[0]
    assert scales[2] <= scales[0]


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
