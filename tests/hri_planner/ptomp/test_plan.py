"""Plans: smooth between knots, still outside, and their transformations."""

import numpy as np
import pytest
from scipy.interpolate import BPoly

from hri_planner.ptomp import JointPlan
from hri_planner.ptomp.plan import connect
from hri_prediction.errors import PlanningError


def _sine_plan(count=40):
    t = np.linspace(1.0, 3.0, count)
    phase = np.arange(7)
    angle = t[:, None] + phase
    return JointPlan(t, np.sin(angle), np.cos(angle), -np.sin(angle))


def test_hermite_follows_a_smooth_motion():
    plan = _sine_plan()
    t = np.linspace(1.0, 3.0, 501)
    q, qd, qdd = plan.sample(t)
    exact = t[:, None] + np.arange(7)
    np.testing.assert_allclose(q, np.sin(exact), atol=1e-9)
    np.testing.assert_allclose(qd, np.cos(exact), atol=1e-6)
    np.testing.assert_allclose(qdd, -np.sin(exact), atol=1e-3)


def test_pieces_are_those_of_an_independent_library():
    plan = _sine_plan(6)
    t = np.linspace(1.0, 3.0, 301)
    knots = np.stack((plan.q, plan.qd, plan.qdd), axis=1)
    reference = BPoly.from_derivatives(plan.time_s, knots)
    for order, part in enumerate(plan.sample(t)):
        np.testing.assert_allclose(part, reference(t, nu=order), atol=1e-9)


def test_derivatives_match_finite_differences():
    plan = _sine_plan(6)
    t, step = np.linspace(1.01, 2.98, 60), 1e-5
    ahead, behind = plan.sample(t + step), plan.sample(t - step)
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * step), plan.sample(t)[1], atol=1e-8)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * step), plan.sample(t)[2], atol=1e-6)


def test_still_outside():
    plan = _sine_plan()
    for t, row in ((0.0, 0), (9.0, -1)):
        q, qd, qdd = plan.sample(t)
        np.testing.assert_array_equal(q, plan.q[row])
        assert not qd.any()
        assert not qdd.any()


def test_transformations():
    plan = _sine_plan()
    t = np.linspace(1.5, 2.9, 20)
    np.testing.assert_allclose(plan.shifted(4.0).sample(t + 4.0), plan.sample(t), atol=1e-12)
    np.testing.assert_allclose(plan.remaining(1.47).sample(t), plan.sample(t), atol=1e-7)
    assert len(plan.remaining(5.0).time_s) == 1


def test_connect_meets_both_ends():
    rng = np.random.default_rng(0)
    state = tuple(rng.standard_normal((3, 7)))
    end = rng.standard_normal(7)
    parts = connect(state, end, 0.8, np.array([0.0, 0.8, 2.0]))
    for part, first in zip(parts, state, strict=True):
        np.testing.assert_allclose(part[0], first, atol=1e-12)
    np.testing.assert_allclose(parts[0][1:], [end, end], atol=1e-12)
    np.testing.assert_allclose(parts[1][1:], 0.0, atol=1e-12)


def test_unusable_plans_are_refused():
    plan = _sine_plan()
    with pytest.raises(PlanningError, match="increase"):
        JointPlan(plan.time_s[::-1].copy(), plan.q, plan.qd, plan.qdd)
    with pytest.raises(PlanningError, match="shapes"):
        JointPlan(plan.time_s, plan.q[:-1], plan.qd, plan.qdd)
