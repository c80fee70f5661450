"""STOMP's update: weights at each time step and smoothing, against plain NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.ptomp import HumanForecast, PtompConfig, TableBox
from hri_planner.ptomp.clearance import mark_columns
from hri_planner.ptomp.column_costs import column_costs
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.kernel import trajectory_costs
from hri_planner.ptomp.layout import FIRST_FREE, ROW, TERM_COUNT, TERMS
from hri_planner.ptomp.optimizer import Optimizer
from hri_planner.ptomp.stepwise import stepwise_update, update_smoother
from hri_planner.robot import load_robot, solve_ik

ROBOT = load_robot()
COLUMNS, COUNT, LAST = 45, 8, 44
STEP = 1.5 / 42
STOMP = {"weights": "per_step", "update_smoothing": True, "accept_worse": True}


def _problem(**changes):
    """A joint motion through an arm that rests on the table."""
    rng = np.random.default_rng(0)
    rest = np.radians([0, -40, 0, 90, 0, -40, 0])
    ends = [solve_ik(ROBOT, np.array([0.5, y, 0.15]), rest, rng) for y in (-0.35, 0.35)]
    x = np.clip((np.arange(COLUMNS) - 2) / (COLUMNS - 3), 0, 1)[:, None]
    path = ends[0] + x**3 * (10 - 15 * x + 6 * x * x) * (ends[1] - ends[0])
    arm = np.array([[0.8, 0, 0.4], [0.75, 0, 0.15], [0.5, 0, 0.15], [0.41, 0, 0.15]])
    people = HumanForecast(0.0, 1.0, arm[None], np.full((1, 4), 0.01), np.full(3, 0.05))
    config = PtompConfig(**changes)
    model = CostModel(ROBOT, config, TableBox((0.5, 0.0, -0.02), (1.0, 1.0, 0.04)))
    model.bind(STEP * np.arange(-2.0, COLUMNS - 2.0), np.array([0.5, 0.35, 0.15]), [people], 0.07)
    return config, model, np.ascontiguousarray(path.T)


@pytest.mark.parametrize("seed", range(3))
def test_column_costs_add_up_to_the_kernels_terms(seed):
    _, model, path = _problem(interaction_costs="case_3")
    rng = np.random.default_rng(seed)
    trajectory = path + 0.4 * rng.standard_normal(path.shape)  # fast, low, beyond limits
    trajectory[:, :FIRST_FREE] = path[:, :1]  # what is past costs the same for all
    padded = model.pad(trajectory[None])[0]
    body, _, _, par, work = model.problem
    terms, out = np.zeros(TERM_COUNT), np.zeros(ROW)
    mark_columns(COLUMNS, work)
    trajectory_costs(padded, COLUMNS, *model.problem, terms)
    column_costs(padded, COLUMNS, body, par, work, out)
    named = dict(zip(TERMS, terms, strict=True))
    alone = (
        "collision", "contact", "joint_limits", "speed", "acceleration", "table", "interaction_learned",
    )  # fmt: skip
    assert all(named[name] > 0.0 for name in alone)
    assert out.sum() == pytest.approx(sum(named[name] for name in alone), rel=1e-9)
    assert not out[:FIRST_FREE].any()
    assert not out[COLUMNS:].any()


def _update(incumbent, trajectories, totals, costs, smoother):
    raw, update = np.ones((7, ROW)), np.ones((7, ROW))
    stepwise_update(
        incumbent, FIRST_FREE, LAST, 10.0, trajectories, totals, costs, smoother, raw, update
    )  # fmt: skip
    return update


def _drawn(seed):
    rng = np.random.default_rng(seed)
    incumbent = rng.standard_normal((7, ROW))
    trajectories = incumbent + rng.standard_normal((COUNT, 7, ROW))
    return incumbent, trajectories, rng.exponential(size=(COUNT, ROW))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.booleans(), st.integers(0, COUNT - 1))
def test_the_update_is_the_papers(seed, smoothed, absent):
    incumbent, trajectories, costs = _drawn(seed)
    totals = np.zeros(COUNT)
    totals[:absent] = np.inf
    size = LAST - FIRST_FREE
    smoother = update_smoother(size if smoothed else 0)
    got = _update(incumbent, trajectories, totals, costs, smoother)
    window = slice(FIRST_FREE, LAST)
    part = costs[absent:, window]
    low, high = part.min(axis=0), part.max(axis=0)
    weights = np.exp(-10.0 * (part - low) / np.maximum(high - low, 1e-12))
    weights /= weights.sum(axis=0)
    noise = (trajectories[absent:] - incumbent)[:, :6, window]
    expected = np.einsum("ki,kji->ji", weights, noise)
    if smoothed:
        expected = expected @ smoother.T
    np.testing.assert_allclose(got[:6, window], expected, atol=1e-12)
    outside = np.delete(got, np.arange(FIRST_FREE, LAST), axis=1)
    assert not outside.any()
    assert not got[6].any()


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_equal_costs_give_the_mean_of_the_noise(seed):
    incumbent, trajectories, _ = _drawn(seed)
    flat = np.ones((COUNT, ROW))
    update = _update(incumbent, trajectories, np.zeros(COUNT), flat, update_smoother(0))
    window = slice(FIRST_FREE, LAST)
    mean = (trajectories - incumbent)[:, :6, window].mean(axis=0)
    np.testing.assert_allclose(update[:6, window], mean, atol=1e-12)


@pytest.mark.parametrize("size", [1, 6, 41])
def test_the_smoother_is_the_scaled_inverse_of_r(size):
    smoother = update_smoother(size)
    np.testing.assert_allclose(np.abs(smoother).max(axis=0), 1.0 / size)
    band = 6 * np.eye(size) - 4 * np.eye(size, k=1) - 4 * np.eye(size, k=-1)
    band += np.eye(size, k=2) + np.eye(size, k=-2)
    product = band @ smoother
    np.testing.assert_allclose(product, np.diag(np.diag(product)), atol=1e-7)


@pytest.mark.parametrize(
    "changes",
    [{"weights": "per_step"}, {"accept_worse": True}, STOMP, {**STOMP, "precision": "single"}],
)
def test_every_update_finds_a_way_and_never_returns_worse(changes):
    config, model, path = _problem(**changes)
    cost = float(model.evaluate(path[None])[0][0])
    costs = []
    for iterations in (0, 5, 60):
        optimizer = Optimizer(config, np.random.default_rng(1))
        result = optimizer.run(
            model, path, cost, free_until=LAST, free_end=False, sd=0.35, iterations=iterations,
            deadline=None,
        )  # fmt: skip
        told = float(model.evaluate(result.trajectory[None])[0][0])
        assert result.cost == pytest.approx(told, rel=1e-3)
        np.testing.assert_array_equal(result.trajectory[:, LAST], model.pad(path[None])[0][:, LAST])
        costs.append(result.cost)
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 0.6 * cost


def test_nothing_but_the_budget_ends_a_search_without_patience():
    config, model, path = _problem(**STOMP, patience=0)
    cost = float(model.evaluate(path[None])[0][0])
    found = {}
    for patience in (0, 5):
        optimizer = Optimizer(replace(config, patience=patience), np.random.default_rng(1))
        found[patience] = optimizer.run(
            model,
            path,
            cost,
            free_until=LAST,
            free_end=False,
            sd=0.35,
            iterations=150,
            deadline=None,
        )
    assert found[0].iterations == 150
    assert found[5].iterations < 150
    assert found[0].cost < found[5].cost
