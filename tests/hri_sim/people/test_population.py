"""Simulated people to evaluate on: repeatable, anatomical, and of different kinds."""

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.people.population import FAMILIES, TARGETS, draw_person, population, record_reach


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


def test_unknown_families_are_refused():
    with pytest.raises(ConfigError, match="people = 'martians'"):
        draw_person("martians", "p", 0)
