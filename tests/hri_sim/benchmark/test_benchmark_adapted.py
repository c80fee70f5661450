"""Planners of the benchmark whose time steps and roll-outs are chosen when the motion starts."""

from dataclasses import replace

import pytest

from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.grid import Cell
from hri_planner.adaptation.model_file import save_model, shipped_model
from hri_planner.ptomp.budget import ADAPTATION_S, START_S
from hri_planner.ptomp.situation import Situation
from hri_sim.benchmark import adapted, episode, first_look, run
from hri_sim.benchmark.adapted import ADAPTED
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.first_look import PERIOD_S, episode_seeds, start_situation
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.benchmark.run import Plan, marks
from hri_sim.benchmark.watching import WATCHED_S

BASE = PLANNERS["ptomp"]


@pytest.fixture(scope="module")
def condition():
    return task_conditions("tuning", 0).conditions[0]


@pytest.fixture(scope="module")
def library():
    return task_library("tuning", 0)


class Picking:
    """A selection by the seed's noise alone; remembers what it was asked."""

    def __init__(self):
        self.seen = []

    def choose(self, situation):
        self.seen.append(situation)
        return Cell(10, 5)


def test_adapted_planners_name_models_that_ship():
    assert {name for name, _, _ in ADAPTED} <= set(PLANNERS)
    for name, _, model in ADAPTED:
        assert PLANNERS[name].adaptation == model
        assert shipped_model(model).choose(Situation(0.02, 0.01, 0.3, 0.7, 50.0))


def test_the_first_look_sees_what_a_planner_of_that_seed_sees(condition, library):
    seen = [start_situation(condition, "promp", BASE.config, library, seed) for seed in (0, 0, 1)]
    assert seen[0] == seen[1]
    assert seen[0].error != seen[2].error
    first = seen[0]
    assert 0.0 < first.uncertainty < 0.2
    assert 0.0 < first.error < 0.05
    assert first.distance > 0.05  # conditions begin clear of the person
    assert 0.0 <= first.time_to_collision <= condition.scenario.reaches[0].duration
    sure = start_situation(condition, "oracle", BASE.config, library, 0)
    assert sure.uncertainty == 0.0
    assert episode_seeds(condition, 0)[0].spawn_key != episode_seeds(condition, 1)[0].spawn_key


def test_the_look_ends_when_the_first_replan_begins(condition, library, monkeypatch):
    """What is chosen decides how long that is before the motion: at most a tenth of it."""
    looked, replanned = [], []

    class Watched(first_look.Watch):
        times = looked

        def advance(self, now_s):
            self.times.append(now_s)
            super().advance(now_s)

    class Replanned(Watched):
        times = replanned

    monkeypatch.setattr(first_look, "Watch", Watched)
    monkeypatch.setattr(episode, "Watch", Replanned)
    start_situation(condition, "promp", BASE.config, library, 0)
    slowest = (("num_timesteps", 10), ("num_rollouts", 5))
    episode.run_episode(condition, replace(BASE, settings=slowest), library, slowdown=64.0, seed=0)
    assert looked == sorted(looked)
    assert looked[-1] == pytest.approx(replanned[0])
    assert -WATCHED_S <= looked[0] < -WATCHED_S + 2.0 * PERIOD_S


def test_the_choice_is_made_charged_and_used(condition, library, monkeypatch):
    selection, granted = Picking(), []
    monkeypatch.setattr(adapted, "shipped_model", lambda name: selection)
    config, charge_s = adapted.adapted_config(BASE.config, "any", condition, "promp", library, 0)
    assert (config.num_timesteps, config.num_rollouts) == (10, 5)
    assert replace(config, num_timesteps=42, num_rollouts=30) == BASE.config
    assert charge_s == ADAPTATION_S
    grant = episode.VirtualTimeBudget.grant

    def note(self, interval_s, rollouts, free_steps, fixed_s=0.0):
        granted.append((interval_s, rollouts, fixed_s))
        return grant(self, interval_s, rollouts, free_steps, fixed_s)

    monkeypatch.setattr(episode.VirtualTimeBudget, "grant", note)
    setup = replace(BASE, adaptation="any")
    outcome = episode.run_episode(condition, setup, library, slowdown=1.0, seed=0)
    assert outcome.time_to_goal is not None
    assert len(selection.seen) == 2
    assert {(interval, rollouts) for interval, rollouts, _ in granted} == {(0.15, 5)}
    extra = granted[0][2] - granted[-1][2]
    assert extra == pytest.approx(START_S + ADAPTATION_S)


def test_a_fixed_cell_costs_nothing_to_choose(condition, library, monkeypatch):
    monkeypatch.setattr(adapted, "shipped_model", lambda name: BestFixed(Cell(20, 10)))
    config, charge_s = adapted.adapted_config(BASE.config, "any", condition, "promp", library, 0)
    assert (config.num_timesteps, config.num_rollouts, charge_s) == (20, 10, 0.0)


def test_rows_of_another_model_do_not_count(tmp_path, monkeypatch):
    plan = Plan((PLANNERS["ptomp_fixed"], BASE), "tuning", 64.0, (0,))
    path = tmp_path / "model.npz"
    monkeypatch.setattr(run, "shipped_path", lambda name: path)
    found = []
    for steps in (20, 25):
        save_model(path, BestFixed(Cell(steps, 10)), {})
        found.append(marks(plan))
    assert found[0]["ptomp_fixed"] != found[1]["ptomp_fixed"]
    assert found[0]["ptomp"] == found[1]["ptomp"]
