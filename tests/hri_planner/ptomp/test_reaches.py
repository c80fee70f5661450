"""A small sample of whole reaches through an imperfectly foreseen person's way."""

import numpy as np
import pytest
from reach_trials import run_trial


@pytest.mark.parametrize(
    ("seed", "interval"), [(9000 + k, (1.5 / 42, 0.0313, 0.02)[k % 3]) for k in range(6)]
)
def test_reach_is_safe_and_arrives(seed, interval):
    outcome = run_trial(seed, iterations=30, interval=interval)
    assert outcome.clearance > 0.0
    assert outcome.error < 1e-3
    assert outcome.speed_share <= 1.0
    assert outcome.jump < 1e-6
    assert outcome.table > 0.0
    assert np.isfinite(outcome.arrived_s)
