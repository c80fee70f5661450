"""Distances of two arms: against an independent library, and what must hold for them."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.ontology.features import COUNT, EXCHANGED, FEATURES, pair_features

RNG = np.random.default_rng(5)
SEEDS = st.integers(0, 10**6)


def arms(seed: int, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(0.0, 0.4, (count, 4, 3)), rng.normal(0.2, 0.4, (count, 4, 3))


def test_names() -> None:
    assert COUNT == len(FEATURES) == 25
    assert FEATURES[0] == "humerus-humerus"
    assert FEATURES[3] == "forearm-humerus"  # number 4
    assert FEATURES[9] == "shoulder-shoulder"
    assert FEATURES[24] == "hand tip-hand tip"  # number 25


def coal_distance(a0: np.ndarray, a1: np.ndarray, b0: np.ndarray, b1: np.ndarray) -> float:
    """Of two segments, as capsules of the same small radius, by coal."""
    radius = 1e-3
    shapes, places = [], []
    for begin, end in ((a0, a1), (b0, b1)):
        axis = end - begin
        length = float(np.linalg.norm(axis))
        z = axis / length
        x = np.cross(z, [1.0, 0.0, 0.0] if abs(z[0]) < 0.9 else [0.0, 1.0, 0.0])
        x /= np.linalg.norm(x)
        shapes.append(coal.Capsule(radius, length))
        places.append(
            coal.Transform3s(np.column_stack((x, np.cross(z, x), z)), 0.5 * (begin + end))
        )
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance = 1e-12
    found = coal.distance(shapes[0], places[0], shapes[1], places[1], request, result)
    return float(found) + 2.0 * radius


def test_segments_against_coal() -> None:
    first, second = arms(1, 60)
    found = pair_features(first, second)
    for row in range(len(first)):
        for i in range(3):
            for j in range(3):
                wanted = coal_distance(
                    first[row, i], first[row, i + 1], second[row, j], second[row, j + 1]
                )
                assert found[row, 3 * i + j] == pytest.approx(wanted, abs=1e-9)


def test_joints_are_plain_distances() -> None:
    first, second = arms(2)
    wanted = np.linalg.norm(first[:, :, None] - second[:, None], axis=-1).reshape(len(first), 16)
    np.testing.assert_allclose(pair_features(first, second)[:, 9:], wanted, atol=1e-14)


@given(SEEDS)
@settings(max_examples=30)
def test_what_must_hold(seed: int) -> None:
    first, second = arms(seed)
    found = pair_features(first, second)
    # Whoever comes first.
    np.testing.assert_allclose(pair_features(second, first), found[:, EXCHANGED], atol=1e-12)
    # Wherever both are.
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    shift = rng.normal(size=3)
    moved = [points @ turn.T + shift for points in (first, second)]
    np.testing.assert_allclose(pair_features(*moved), found, atol=1e-12)
    # Segments are no farther apart than their ends.
    ends = found[:, 9:].reshape(-1, 4, 4)
    for i in range(3):
        for j in range(3):
            nearest_ends = ends[:, i : i + 2, j : j + 2].min(axis=(1, 2))
            assert (found[:, 3 * i + j] <= nearest_ends + 1e-12).all()


def test_what_is_not_seen_is_not_known() -> None:
    first, second = arms(3)
    first[1, 2] = np.nan  # a wrist
    found = pair_features(first, second)
    assert np.isfinite(found[[0, 2]]).all()
    unknown = np.flatnonzero(np.isnan(found[1])) + 1
    # Forearm, hand, and the wrist itself.
    assert unknown.tolist() == [4, 5, 6, 7, 8, 9, 18, 19, 20, 21]


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(DataError, match=r"second have shape \(2, 4, 3\); expected \(3, 4, 3\)"):
        pair_features(np.zeros((3, 4, 3)), np.zeros((2, 4, 3)))
