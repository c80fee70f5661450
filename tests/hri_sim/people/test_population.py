"""Simulated people to evaluate on: repeatable, anatomical, and of different kinds."""

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.people.changes import CHANGE, ChangedMind
from hri_sim.people.motion import HandMotion
from hri_sim.people.population import (
    FAMILIES,
    TARGETS,
    draw_person,
    population,
    record_reach,
)


def still(family: str, seed: int = 0):
    """A person without noise and drop-outs."""
    quiet = {"noise_sd": 0.0, "dropout_rate": 0.0, "marker_dropout_rate": 0.0}
    return draw_person(family, "somebody", seed).model_copy(update=quiet)


def path_of(family: str, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return record_reach(still(family, seed), family, "far_side", 0, rng).track.keypoints[:, 3]


def bend(path: np.ndarray) -> float:
    """Largest distance from the straight line, as a share of its length."""
    way = path[-1] - path[0]
    along = (path - path[0]) @ way / (way @ way)
    return float(
        np.linalg.norm(path - path[0] - along[:, None] * way, axis=1).max() / np.linalg.norm(way)
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_reaches_are_repeatable_and_arms_keep_their_lengths(family):
    one, two = population(family, 2, 1, seed=3), population(family, 1, 2, seed=3)
    assert len(one) == len(two) == 2 * len(TARGETS)
    np.testing.assert_array_equal(one[0].track.keypoints, two[0].track.keypoints)
    other = population(family, 1, 1, seed=4)
    assert len(other[0].track) != len(one[0].track) or not np.array_equal(
        other[0].track.keypoints, one[0].track.keypoints
    )
    spec = still(family)
    rng = np.random.default_rng(0)
    for task, target in TARGETS.items():
        reach = record_reach(spec, family, task, 0, rng)
        points = reach.track.keypoints
        lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
        np.testing.assert_allclose(
            lengths, [[spec.upper_arm, spec.forearm, spec.hand]] * len(points)
        )
        assert np.linalg.norm(points[-1, 3] - target) < 0.08
        assert reach.truth.onset_s == 0.0
        speed = np.linalg.norm(np.diff(points[:, 3], axis=0), axis=1) * 250.0
        middle = reach.track.time_s[1:] - 0.002
        outside = (middle < 0.0) | (middle > reach.truth.end_s)
        assert speed[outside].max() < 0.01 < speed[~outside].max()


def test_families_differ_as_they_say():
    assert bend(path_of("minimum_jerk")) < 1e-6
    assert bend(path_of("matched")) > 0.03
    bends = [bend(path_of("via_points", seed)) for seed in range(5)]
    assert min(bends) > 0.08
    usual = [draw_person("matched", f"p{i}", 0).upper_arm for i in range(20)]
    others = [draw_person("other_lengths", f"p{i}", 0).upper_arm for i in range(20)]
    assert np.ptp(others) > 1.5 * np.ptp(usual)
    for family in ("matched", "via_points", "minimum_jerk"):
        assert draw_person(family, "p1", 0).upper_arm == draw_person("matched", "p1", 0).upper_arm


def test_who_changes_their_mind_sets_out_to_another_target_and_arrives_at_the_named_one():
    away = []
    for seed in range(8):
        spec, rng = still("changed_mind", seed), np.random.default_rng(seed)
        reach = record_reach(spec, "changed_mind", "near_side", 0, rng)
        tip, time = reach.track.keypoints[:, 3], reach.track.time_s
        assert reach.track.task == "near_side"
        assert np.linalg.norm(tip[-1] - TARGETS["near_side"]) < 0.08
        usual = record_reach(spec, "matched", "near_side", 0, np.random.default_rng(seed))
        assert reach.truth.duration_s > (0.9 + CHANGE[0]) * usual.truth.duration_s
        begin = np.searchsorted(time, 0.3)
        heading, due = tip[begin] - tip[0], np.array(TARGETS["near_side"]) - tip[0]
        # The other targets all lie on one side of the way to this one.
        away.append(heading[0] * due[1] - heading[1] * due[0])
    assert max(away) < 0.0


def test_the_diverted_hand_has_no_jump_in_speed_or_acceleration():
    for seed in range(8):
        rng = np.random.default_rng(seed)
        reach = record_reach(still("changed_mind", seed), "changed_mind", "raised", 0, rng)
        velocity = np.diff(reach.track.keypoints[:, 3], axis=0) * 250.0
        acceleration = np.diff(velocity, axis=0) * 250.0
        assert np.abs(np.diff(velocity, axis=0)).max() < 0.04
        # A movement that were cut off and another one begun would jump by its acceleration.
        assert np.abs(np.diff(acceleration, axis=0)).max() < 0.12 * np.abs(acceleration).max()


def test_two_movements_add_up():
    first = HandMotion(0.0, 1.0, np.zeros(3), np.array([0.3, 0.0, 0.0]), np.zeros(3), (0.1, 0.2))
    way = np.array([0.3, 0.2, 0.1])
    second = HandMotion(0.4, 1.2, first.end, way, np.zeros(3), (0.2, 0.3))
    changed = ChangedMind(first, second)
    assert changed.duration == pytest.approx(1.6)
    times = np.array([0.0, 0.39, 1.6])
    tip, swivel = changed.sample(times)
    np.testing.assert_allclose(tip[:2], first.sample(times[:2])[0])
    np.testing.assert_allclose(tip[2], way)
    np.testing.assert_allclose(swivel[[0, 2]], [0.1, 0.3])
    step = 1e-3
    near = changed.sample(0.4 + step * np.array([-1.0, 0.0, 1.0]))[0]
    alone = first.sample(0.4 + step * np.array([-1.0, 0.0, 1.0]))[0]
    np.testing.assert_allclose(np.diff(near, 2, axis=0), np.diff(alone, 2, axis=0), atol=1e-8)
    short = ChangedMind(first, HandMotion(0.3, 0.5, first.end, way, np.zeros(3), (0.2, 0.3)))
    assert short.duration == first.duration


def test_unknown_families_are_refused():
    with pytest.raises(ConfigError, match="people = 'martians'"):
        draw_person("martians", "p", 0)
