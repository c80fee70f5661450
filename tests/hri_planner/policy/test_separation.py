"""The separation is kept, whatever a bounded partner does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.policy.separation import SeparationConfig, keep_separation
from hri_prediction.errors import ConfigError

CONFIG = SeparationConfig()
DT = 0.004


def encounter(rng: np.random.Generator, steps: int, kind: str) -> float:
    """Smallest distance of a hand that wants through the partner's, and a partner that does not care."""
    x, v = rng.uniform(-0.1, 0.1, 3) + np.array((0.5, 0.0, 0.0)), np.zeros(3)
    p, w = rng.uniform(-0.1, 0.1, 3) - (0.3, 0.0, 0.0), np.zeros(3)
    most = CONFIG.partner_acceleration
    nearest = np.inf
    for _ in range(steps):
        aim = {"chases": x, "stands": p, "comes": np.array((0.6, 0.0, 0.0))}.get(kind)
        if aim is None:
            push = rng.standard_normal(3)
            push *= most / np.linalg.norm(push)
        else:
            push = 20.0 * (aim - p) - 4.0 * w
            push *= min(1.0, most / max(float(np.linalg.norm(push)), 1e-9))
        wanted = 15.0 * (np.array((-0.3, 0.0, 0.0)) - x) - 6.0 * v
        told = keep_separation(wanted, x - p, v - w, DT, CONFIG).acceleration
        assert np.linalg.norm(told) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
        x, v = x + v * DT + 0.5 * told * DT**2, v + told * DT
        p, w = p + w * DT + 0.5 * push * DT**2, w + push * DT
        nearest = min(nearest, float(np.linalg.norm(x - p)))
    return nearest


@pytest.mark.parametrize("kind", ["chases", "stands", "comes", "jitters"])
def test_the_separation_is_kept(kind: str) -> None:
    rng = np.random.default_rng(11)
    nearest = [encounter(rng, 400, kind) for _ in range(6)]
    assert min(nearest) >= CONFIG.separation - 1e-9
    assert max(nearest) < 0.9


vectors = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)


@settings(max_examples=200, deadline=None)
@given(wanted=vectors, offset=vectors, velocity=vectors)
def test_nothing_is_changed_that_need_not_be(wanted, offset, velocity) -> None:
    found = keep_separation(wanted, offset, velocity, DT, CONFIG)
    assert np.isfinite(found.acceleration).all()
    assert np.linalg.norm(found.acceleration) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
    if not found.changed:
        assert found.acceleration == pytest.approx(wanted)
    elif found.margin > 0.0:
        # Pushed outwards along the line of both hands, and nowhere else but to stay within bounds.
        outward = offset / np.linalg.norm(offset)
        change = found.acceleration - wanted
        assert change @ outward > 0.0
        if np.linalg.norm(found.acceleration) < CONFIG.hand_acceleration * (1.0 - 1e-6):
            assert np.cross(change, outward) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_far_partner_changes_nothing() -> None:
    wanted = np.array((1.0, 2.0, 3.0))
    found = keep_separation(wanted, np.array((2.0, 0.0, 0.0)), np.zeros(3), DT, CONFIG)
    assert not found.changed
    assert found.acceleration == pytest.approx(wanted)


def test_a_partner_as_quick_as_the_hand_is_refused() -> None:
    with pytest.raises(ConfigError, match="partner_acceleration = 8"):
        SeparationConfig(partner_acceleration=8.0)
