"""A policy knows its goals, and ways between any place and them."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.dmp.frames import carried, way_frame
from hri_planner.dmp.policy import HOME, DmpPolicy
from hri_prediction.errors import DataError, PlanningError

START = np.array((0.39, 0.0, 0.33))
GOALS = {"left": np.array((0.56, 0.24, 0.12)), "right": np.array((0.56, -0.24, 0.12))}
POSTURE = np.array((0.0, -0.14, 0.0, 1.97, 0.0, -1.0, 0.0))


def new(**changes: Any) -> DmpPolicy:
    rng = np.random.default_rng(0)
    weights = {name: 0.05 * rng.standard_normal((3, 20)) for name in GOALS}
    values: dict[str, Any] = {
        "start": START, "posture": POSTURE, "goals": GOALS, "weights": weights, "duration": 2.5
    }  # fmt: skip
    return DmpPolicy(**{**values, **changes})


def test_paths_lead_from_the_start_to_the_goals() -> None:
    policy = new()
    assert policy.names == ("left", "right")
    for name, goal in GOALS.items():
        path = policy.path(name)
        assert path.shape == (626, 3)
        np.testing.assert_array_equal(path[0], START)
        assert np.linalg.norm(path[-1] - goal) < 1e-4
    assert len(policy.response(5.0).times) == 1251


@pytest.mark.parametrize("name", ["middle", "", HOME])
def test_there_is_no_path_to_what_is_no_goal(name: str) -> None:
    with pytest.raises(PlanningError, match=r"expected .*left.*right"):
        new().path(name)


def test_a_place_is_known_by_its_goal() -> None:
    policy = new()
    for name, place in {**GOALS, HOME: START}.items():
        assert policy.name_of(place) == name
        assert policy.name_of(place + 0.005) == name


@pytest.mark.parametrize("place", [(0.6, 0.0, 0.1), (np.nan, 0.0, 0.0), (0.56, 0.24, 0.15)])
def test_for_other_places_the_goals_are_named(place: tuple[float, ...]) -> None:
    with pytest.raises(PlanningError) as found:
        new().name_of(np.array(place))
    for text in ("left (0.560, 0.240, 0.120)", "right (0.560, -0.240, 0.120)", "start (0.390"):
        assert text in str(found.value)


def test_from_the_start_ways_are_the_learnt_ones() -> None:
    policy = new()
    for name in GOALS:
        for offset in (0.0, 0.001):
            own = policy.weights_from(START + np.array((offset, 0.0, 0.0)), name)
            np.testing.assert_array_equal(own, policy.weights[name])
    with pytest.raises(PlanningError, match="no goal 'middle'"):
        policy.weights_from(START, "middle")


def similar(path: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of all distances within two paths, as shares of their ways."""
    distances = []
    for points in (path[::25], other[::25]):
        apart = np.linalg.norm(points[:, None] - points, axis=-1)
        distances.append(apart / np.linalg.norm(points[-1] - points[0]))
    return float(np.abs(distances[0] - distances[1]).max())


def test_from_elsewhere_ways_are_similar() -> None:
    policy, tool = new(), np.array((0.3, 0.2, 0.4))
    for name, goal in GOALS.items():
        own = policy.weights_from(tool, name)
        path = policy.response().rollouts(tool, goal, own)
        assert similar(path, policy.path(name)) < 1e-3
    at_goal = policy.weights_from(GOALS["left"], "left")
    np.testing.assert_array_equal(at_goal, np.zeros((3, 20)))


def test_the_way_home_is_the_way_there_backwards() -> None:
    """Of motions as smooth as people are shown; what ends with a jerk cannot begin with it."""
    smooth = {
        name: 0.1 * np.sin(np.linspace(0.0, np.pi, 20)) * np.array(((0.3,), (side,), (1.0,)))
        for name, side in (("left", 0.5), ("right", -0.5))
    }
    policy = new(weights=smooth)
    for name, goal in GOALS.items():
        there = policy.path(name)
        back = policy.response().rollouts(goal, START, policy.weights_from(goal, HOME))
        assert np.linalg.norm(back[-1] - START) < 1e-4
        assert np.sqrt(np.mean(np.sum((back[::-1] - there) ** 2, axis=1))) < 2e-3
    # Beside a goal, too.
    beside = GOALS["right"] + (0.01, 0.0, 0.01)
    back = policy.response().rollouts(beside, START, policy.weights_from(beside, HOME))
    assert similar(back[::-1], policy.path("right")) < 0.05


def test_at_the_start_the_way_home_is_none() -> None:
    np.testing.assert_array_equal(new().weights_from(START, HOME), np.zeros((3, 20)))


metres = st.floats(-1.0, 1.0)
places = arrays(float, 3, elements=metres)


@settings(max_examples=100, deadline=None)
@given(start=places, goal=places)
def test_the_frame_of_a_way_is_a_rotation_along_it(start, goal) -> None:
    frame, way = way_frame(start, goal), goal - start
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    if np.linalg.norm(way) > 1e-6:
        np.testing.assert_allclose(frame[:, 0], way / np.linalg.norm(way), atol=1e-9)
        assert abs(frame[2, 1]) < 1e-9 or abs(frame[2, 0]) > 0.98, "y is level"


@settings(max_examples=50, deadline=None)
@given(start=places, goals=arrays(float, (2, 3), elements=metres))
def test_a_policy_that_is_moved_makes_similar_ways(start, goals) -> None:
    named = dict(zip(GOALS, goals, strict=True))
    assume(min(np.linalg.norm(goal - start) for goal in goals) > 0.02)
    policy = new()
    moved = policy.moved(start, POSTURE, named)
    assert moved.duration == policy.duration
    for name, goal in named.items():
        path = moved.path(name)
        scale = np.linalg.norm(goal - start) / np.linalg.norm(GOALS[name] - START)
        assert np.linalg.norm(path[-1] - goal) < 1e-4 * max(scale, 1.0)
        assert similar(path, policy.path(name)) < 5e-3
    again = moved.moved(START, POSTURE, GOALS)
    for name in GOALS:
        np.testing.assert_allclose(again.weights[name], policy.weights[name], atol=1e-9)


def test_without_other_goals_only_the_start_is_moved() -> None:
    policy = new()
    moved = policy.moved(START + np.array((0.05, 0.05, 0.0)), POSTURE + 0.1)
    assert moved.names == policy.names
    for name in GOALS:
        np.testing.assert_array_equal(moved.goals[name], GOALS[name])
    np.testing.assert_array_equal(moved.posture, POSTURE + 0.1)
    np.testing.assert_allclose(
        new().moved(START, POSTURE).weights["left"], policy.weights["left"], atol=1e-12
    )


@pytest.mark.parametrize("name", ["middle", HOME])
def test_a_policy_is_not_moved_to_goals_that_it_does_not_know(name: str) -> None:
    with pytest.raises(PlanningError, match=f"no goal '{name}'"):
        new().moved(START, POSTURE, {**GOALS, name: np.array((0.6, 0.0, 0.2))})


def test_a_way_of_no_length_keeps_its_weights() -> None:
    weights = np.random.default_rng(1).standard_normal((3, 20))
    np.testing.assert_allclose(carried(weights, (START, START), (START, START)), weights)


OTHER = {"left": np.zeros((3, 20)), "right": np.zeros((3, 20))}


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"goals": {}, "weights": {}}, "expected at least one"),
        ({"goals": {**GOALS, HOME: START + 0.1}, "weights": {**OTHER, HOME: OTHER["left"]}},
         "none of them named 'start'"),
        ({"weights": {"left": OTHER["left"]}}, r"weights for \['left'\]; expected for"),
        ({"duration": 0.0}, r"duration 0\.0 s; expected 0\.2 to 30"),
        ({"duration": np.nan}, "duration nan s"),
        ({"start": np.zeros(2)}, r"start has shape \(2,\)"),
        ({"start": np.array((0.0, np.nan, 0.0))}, "start has shape .* expected finite"),
        ({"posture": np.zeros(6)}, r"posture has shape \(6,\)"),
        ({"goals": {**GOALS, "left": np.full(3, np.inf)}}, "goal left has shape"),
        ({"goals": {**GOALS, "left": START + 0.001}}, "goal left is the start"),
        ({"weights": {**OTHER, "right": np.zeros((2, 20))}}, r"weights of right has shape \(2, 20\)"),
        ({"weights": {**OTHER, "right": np.zeros((3, 2))}}, r"weights of right have shape \(3, 2\)"),
        ({"weights": {**OTHER, "right": np.full((3, 20), np.nan)}}, "weights of right"),
        ({"weights": {**OTHER, "right": np.array(0.0)}}, "weights of right"),
        ({"weights": {**OTHER, "right": np.zeros((3, 10))}}, "weights of right"),
    ],
)  # fmt: skip
def test_what_makes_no_policy_is_refused(changes: dict[str, Any], match: str) -> None:
    with pytest.raises(DataError, match=match):
        new(**changes)


def test_a_changed_policy_forgets_its_ways_back() -> None:
    policy = new()
    policy.weights_from(GOALS["left"], HOME)
    other = replace(policy, weights=OTHER)
    wanted = new(weights=OTHER).weights_from(GOALS["left"], HOME)
    np.testing.assert_array_equal(other.weights_from(GOALS["left"], HOME), wanted)
