"""Virtual time: what fits into an interval, and what is left for the next."""

import math
from itertools import pairwise

import pytest

from hri_planner.ptomp.budget import VirtualTimeBudget

INTERVAL_S = 1.5 / 42


@pytest.mark.parametrize("slowdown", [1.0, 8.0, 64.0, 512.0])
def test_iterations_follow_the_cost_model_in_the_long_run(slowdown):
    budget = VirtualTimeBudget(slowdown)
    cost = slowdown * (15e-6 + 0.30e-6 * 30 * (42 + 3))
    counts = [budget.grant(INTERVAL_S, 30, 42) for _ in range(200)]
    assert sum(counts) in (math.floor(200 * INTERVAL_S / cost), round(200 * INTERVAL_S / cost))
    assert max(counts) - min(counts) <= 1
    assert counts[0] == math.floor(INTERVAL_S / cost)


def test_fixed_costs_are_paid_first_and_no_time_is_spent_twice():
    budget = VirtualTimeBudget(64.0)
    cost = 64.0 * (15e-6 + 0.30e-6 * 30 * (42 + 3))
    spent, replans = 0.0, []
    for interval in range(300):
        count = budget.grant(INTERVAL_S, 30, 42, 2e-3)
        if count is not None:
            spent += 64.0 * 2e-3 + count * cost
            replans.append(interval)
        assert spent <= (interval + 1) * INTERVAL_S + 1e-9
    # 128 ms for what is fixed, of intervals of 36 ms: three or four of them.
    assert {b - a for a, b in pairwise(replans)} <= {3, 4}


def test_a_fast_machine_replans_in_every_interval():
    budget = VirtualTimeBudget()
    counts = [budget.grant(INTERVAL_S, 30, steps, 3e-3) for steps in (42, 20, 0)]
    assert counts == sorted(counts)
    assert counts[0] > 50
