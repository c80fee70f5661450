"""Label and integrator are exact inverses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.rnn.integration import accelerations, initial_velocity, integrate
from hri_prediction.errors import DataError

DT = 0.032


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), steps=st.integers(2, 200))
def test_integrated_labels_give_the_recording_back(seed: int, steps: int) -> None:
    rng = np.random.default_rng(seed)
    path = np.cumsum(0.02 * rng.standard_normal((steps, 3)), axis=0)
    found = integrate(path[0], initial_velocity(path, DT), accelerations(path, DT), DT)
    assert found == pytest.approx(path, abs=1e-9)


def test_a_hand_at_rest_has_no_acceleration() -> None:
    assert not accelerations(np.ones((5, 3)), DT).any()


def test_batches_are_integrated_as_single_ones_are() -> None:
    rng = np.random.default_rng(0)
    start, speed, told = (
        rng.normal(size=(4, 3)),
        rng.normal(size=(4, 3)),
        rng.normal(size=(4, 9, 3)),
    )
    together = integrate(start, speed, told, DT)
    for row in range(4):
        alone = integrate(start[row], speed[row], told[row], DT)
        np.testing.assert_array_equal(together[row], alone)


def test_unusable_paths_are_named() -> None:
    with pytest.raises(DataError, match=r"shape \(1, 3\)"):
        accelerations(np.zeros((1, 3)), DT)
    path = np.zeros((4, 3))
    path[2, 1] = np.nan
    with pytest.raises(DataError, match="position 2"):
        accelerations(path, DT)
