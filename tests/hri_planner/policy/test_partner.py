"""Where a partner's arm is nearest, and how that place moves."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.policy.partner import Partner
from hri_prediction.errors import DataError

JOINTS = np.array(((0.9, 0.0, 0.4), (0.7, 0.1, 0.2), (0.6, 0.05, 0.2), (0.5, 0.0, 0.25)))
SPEEDS = np.array(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 0.1, 0.0), (0.4, 0.2, 0.1)))
ARM = Partner(JOINTS[-1], SPEEDS[-1], joints=JOINTS, speeds=SPEEDS)
places = st.lists(st.floats(-1.0, 2.0), min_size=3, max_size=3).map(np.array)


@settings(max_examples=100, deadline=None)
@given(point=places)
def test_no_other_place_of_the_arm_is_nearer(point) -> None:
    shares = np.linspace(0.0, 1.0, 101)[:, None]
    dense = np.concatenate([(1 - shares) * a + shares * b for a, b in pairwise(JOINTS)])
    found = ARM.distance(point)
    least = np.linalg.norm(dense - point, axis=1).min()
    assert found <= least + 1e-9
    assert found == pytest.approx(least, abs=3e-3)


def test_the_place_moves_as_the_limb_does() -> None:
    middle = 0.25 * JOINTS[2] + 0.75 * JOINTS[3]
    place, speed = ARM.nearest(middle)
    assert place == pytest.approx(middle)
    assert speed == pytest.approx(0.25 * SPEEDS[2] + 0.75 * SPEEDS[3])


def test_what_is_extrapolated_grows_old() -> None:
    later = ARM.later(0.02).later(0.03)
    assert later.age == pytest.approx(0.05)
    assert later.joints == pytest.approx(JOINTS + 0.05 * SPEEDS)
    assert later.position == pytest.approx(JOINTS[-1] + 0.05 * SPEEDS[-1])


def test_a_hand_alone_is_all_there_is() -> None:
    hand = Partner(JOINTS[-1], SPEEDS[-1])
    assert hand.distance(JOINTS[0]) == pytest.approx(np.linalg.norm(JOINTS[0] - JOINTS[-1]))


def test_what_is_not_finite_is_refused() -> None:
    with pytest.raises(DataError, match="partner"):
        Partner(JOINTS[-1], SPEEDS[-1], joints=JOINTS * np.nan, speeds=SPEEDS).check()
