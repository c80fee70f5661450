"""What a policy sees."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.rnn.features import FeatureConfig, features, push

CONFIG = FeatureConfig()
ZERO = np.zeros(3)

coordinates = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


@settings(max_examples=200, deadline=None)
@given(hand=coordinates, goal=coordinates, partner=coordinates)
def test_the_push_points_away_and_is_bounded(hand, goal, partner) -> None:
    found = features(hand, goal, partner, CONFIG)
    assert found[:3] == pytest.approx(goal - hand)
    away, length = found[3:], np.linalg.norm(found[3:])
    assert length <= CONFIG.longest_push * (1.0 + 1e-9)
    assert away @ (hand - partner) >= 0.0
    if np.linalg.norm(hand - partner) >= CONFIG.influence:
        assert length == pytest.approx(0.0, abs=1e-9)


def test_the_push_is_that_of_the_thesis_within_its_reach() -> None:
    offset = np.array((0.2, 0.0, 0.0))
    strength = (1.0 / 0.4 - 1.0 / 0.2) / 0.2
    assert push(offset, CONFIG) == pytest.approx(strength * offset)
    assert push(offset, CONFIG)[0] < 0.0


def test_hands_that_coincide_push_nowhere() -> None:
    assert not push(ZERO, CONFIG).any()


@settings(max_examples=50, deadline=None)
@given(hand=coordinates, goal=coordinates, partner=coordinates, shift=coordinates)
def test_features_do_not_depend_on_the_origin(hand, goal, partner, shift) -> None:
    moved = features(hand + shift, goal + shift, partner + shift, CONFIG)
    assert moved == pytest.approx(features(hand, goal, partner, CONFIG), rel=1e-6, abs=1e-6)
