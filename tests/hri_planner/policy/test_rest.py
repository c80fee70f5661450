"""Coming to rest keeps within limits wherever braking can, and never turns back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.policy.rest import LIMIT_MARGIN, coming_to_rest
from hri_planner.ptomp.plan import JointPlan

MOST = 25.0
LOWER, UPPER = np.full(7, -1.0), np.full(7, 1.0)
unit = st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7).map(np.array)


def plan_of(q: np.ndarray, qd: np.ndarray) -> JointPlan:
    times, *rest = coming_to_rest(q, qd, MOST, LOWER, UPPER)
    first = (q[None], qd[None], np.zeros((1, 7)))
    knots = (np.concatenate(pair) for pair in zip(first, rest, strict=True))
    return JointPlan(np.append(0.0, times), *knots)


@settings(max_examples=200, deadline=None)
@given(where=unit, share=unit)
def test_the_limits_are_kept_between_knots_too(where: np.ndarray, share: np.ndarray) -> None:
    room = np.where(share > 0.0, UPPER - where, where - LOWER)
    # As quick as braking with the largest acceleration allows.
    qd = share * np.minimum(np.sqrt(2.0 * MOST * room), 2.2)
    plan = plan_of(where, qd)
    q, speed, qdd = plan.sample(np.linspace(0.0, plan.end_s, 400))
    assert (q >= LOWER - 1e-5).all()
    assert (q <= UPPER + 1e-5).all()
    # Never back.
    assert (speed * np.sign(qd) >= -2e-3).all()
    assert np.abs(qdd).max() <= 1.7 * MOST
    assert (plan.qd[-1] == 0.0).all()
    assert (plan.qdd[-1] == 0.0).all()


def test_far_from_limits_all_stop_together() -> None:
    qd = np.array((1.0, -0.5, 0.2, 0.0, 0.0, 0.0, 0.0))
    plan = plan_of(np.zeros(7), qd)
    assert plan.end_s == pytest.approx(0.1)
    assert plan.q[-1] == pytest.approx(0.5 * 0.1 * qd)
    # In a straight line of the joints.
    q = plan.sample(0.03)[0]
    assert q[1] / q[0] == pytest.approx(-0.5)


def test_a_joint_near_its_limit_stops_sooner() -> None:
    q, qd = np.zeros(7), np.full(7, 1.0)
    q[3] = 0.97
    plan = plan_of(q, qd)
    assert plan.q[-1, 3] == pytest.approx(1.0 - LIMIT_MARGIN)
    assert plan.q[-1, 0] == pytest.approx(0.05)
    assert plan.sample(0.06)[1][3] == pytest.approx(0.0, abs=1e-6)


def test_joints_rest_before_their_limits() -> None:
    """By the error with which they follow, where braking leaves the room for it."""
    room, speed = 0.02, 0.5
    q, qd = np.full(7, 1.0 - room), np.full(7, speed)
    assert speed**2 / (2.0 * MOST) < room - LIMIT_MARGIN
    plan = plan_of(q, qd)
    assert plan.q[-1] == pytest.approx(1.0 - LIMIT_MARGIN)
    already = plan_of(np.full(7, 0.9995), np.full(7, 0.05))  # within the margin: as short as can be
    assert (already.q[-1] < 1.0).all()
