"""Segment and capsule distances against coal and against their own algebra."""

import coal
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_prediction.errors import DataError
from hri_prediction.geometry import capsule_distances, closest_parameters, segment_distance

POINTS = arrays(np.float64, (4, 3), elements=st.floats(-1.5, 1.5, width=32))


def _coal_distance(a0, a1, ra, b0, b1, rb):
    shapes, poses = [], []
    for start, end, radius in ((a0, a1, ra), (b0, b1, rb)):
        axis = end - start
        length = np.linalg.norm(axis)
        z = axis / length
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        x /= np.linalg.norm(x)
        rotation = np.column_stack((x, np.cross(z, x), z))
        shapes.append(coal.Capsule(radius, length))
        poses.append(coal.Transform3s(rotation, (start + end) / 2))
    result = coal.DistanceResult()
    request = coal.DistanceRequest()
    return coal.distance(shapes[0], poses[0], shapes[1], poses[1], request, result)


def test_matches_coal():
    rng = np.random.default_rng(1)
    for _ in range(2000):
        a, b = rng.uniform(-0.7, 0.7, (2, 2, 3))
        ra, rb = rng.uniform(0.02, 0.08, 2)
        ours = capsule_distances(a[None], np.array([ra]), b[None], np.array([rb]))[0, 0]
        assert ours == pytest.approx(_coal_distance(*a, ra, *b, rb), abs=1e-9)


@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
def test_nearly_parallel_segments(tilt):
    a0, a1 = np.zeros(3), np.array([1.0, 0.0, 0.0])
    b0, b1 = np.array([-0.5, 0.2, 0.0]), np.array([0.7, 0.2 + tilt, 0.0])
    # The gap grows along a when tilt > 0, so the start of a is closest.
    direction = (b1 - b0) / np.linalg.norm(b1 - b0)
    exact = np.linalg.norm(np.cross(a0 - b0, direction))
    assert segment_distance(a0, a1, b0, b1) == pytest.approx(exact, abs=1e-12)


@settings(max_examples=200, deadline=None)
@given(POINTS, arrays(np.float64, (3,), elements=st.floats(-2, 2)), st.floats(-3.1, 3.1))
def test_symmetric_and_invariant(points, shift, angle):
    a0, a1, b0, b1 = points
    distance = segment_distance(a0, a1, b0, b1)
    assert segment_distance(b0, b1, a0, a1) == pytest.approx(distance, abs=1e-7)
    assert segment_distance(a1, a0, b0, b1) == pytest.approx(distance, abs=1e-7)
    c, s = np.cos(angle), np.sin(angle)
    moved = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + shift
    assert segment_distance(*moved) == pytest.approx(distance, abs=1e-7)


@settings(max_examples=200, deadline=None)
@given(POINTS)
def test_parameters_name_the_closest_points(points):
    a0, a1, b0, b1 = points
    s, t, squared = closest_parameters(a0, a1, b0, b1)
    assert 0.0 <= s <= 1.0
    assert 0.0 <= t <= 1.0
    gap = a0 + s * (a1 - a0) - b0 - t * (b1 - b0)
    assert squared == pytest.approx(gap @ gap, abs=1e-12)
    grid = np.linspace(0, 1, 15)
    first = a0 + grid[:, None] * (a1 - a0)
    second = b0 + grid[:, None] * (b1 - b0)
    sampled = np.linalg.norm(first[:, None] - second[None], axis=-1).min()
    assert np.sqrt(squared) <= sampled + 1e-9


def test_points_crossings_and_nan():
    origin, x, y = np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    assert segment_distance(origin, origin, x, x) == 1.0
    assert segment_distance(-x, x, -y, y) == 0.0
    assert np.isnan(segment_distance(origin, np.full(3, np.nan), x, y))


def test_wrong_shapes_are_refused():
    with pytest.raises(DataError, match="radii"):
        capsule_distances(np.zeros((2, 2, 3)), np.zeros(3), np.zeros((1, 2, 3)), np.zeros(1))
