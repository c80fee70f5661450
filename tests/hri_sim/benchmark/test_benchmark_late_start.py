"""How late planners set off, and what is left of a test by then."""

from __future__ import annotations

import numpy as np
import pytest

from hri_planner.ptomp.budget import START_S, replan_charge
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.episode import watch_episode
from hri_sim.benchmark.late_start import start_delay, still_collides
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.planners import NOMINAL, PLANNERS
from hri_sim.scenario.conditions import ROBOT_DURATION_S


@pytest.mark.parametrize("name", ["ptomp", "core_only"])
def test_the_delay_is_that_of_the_benchmark(name):
    setup, slowdown = PLANNERS[name], 64.0
    condition = task_conditions("tuning", 0).conditions[0]
    library = task_library("tuning", 0)
    run, _ = watch_episode(condition, setup, library, slowdown=slowdown, seed=0)
    first = np.flatnonzero(np.abs(run.qd).max(axis=1) > 0.0)[0] * run.step_s
    assert first == pytest.approx(start_delay(setup, slowdown), abs=2 * run.step_s)
    assert first > 0.3


def test_nothing_is_late_on_the_reference_machine():
    for name in (NOMINAL, "ptomp", "itomp", "stomp_prior"):
        assert start_delay(PLANNERS[name], 1.0) == 0.0
    assert start_delay(PLANNERS[NOMINAL], 64.0) == 0.0


def test_who_plans_once_gets_the_time_of_one_motion_and_then_waits_like_all():
    setup = PLANNERS["stomp_prior"]
    owed = 512.0 * (replan_charge(setup.config) + START_S) - ROBOT_DURATION_S
    assert start_delay(setup, 512.0) == pytest.approx(owed, abs=0.1)
    assert owed > 1.0


def test_conditions_collide_at_once_but_not_for_ever():
    drawn = [c for number in range(4) for c in task_conditions("tuning", number).conditions]
    assert all(still_collides(condition, 0.0) for condition in drawn)
    later = [still_collides(condition, 0.5) for condition in drawn]
    assert 0 < sum(later) < len(drawn)
