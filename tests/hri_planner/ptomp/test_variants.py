"""Peers, ablations and literal forms by name."""

from dataclasses import asdict

import numpy as np
import pytest

from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner, load_default_config
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.horizon import margin_in_force
from hri_planner.ptomp.variants import find_variant, variants
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError

ROBOT = load_robot()
ARM = np.array([[0.8, 0, 0.4], [0.75, 0, 0.15], [0.5, 0, 0.15], [0.41, 0, 0.15]])


def test_each_setting_differs_from_the_default():
    default = asdict(load_default_config())
    assert next(iter(variants())) == "ptomp"
    for variant in variants().values():
        assert variant.config is not None
        assert {k: v for k, v in variant.settings.items() if default[k] == v} == {}
    assert {"itomp", "stomp", "stomp_prior"} <= set(variants())


def test_an_unknown_name_lists_those_there_are():
    with pytest.raises(ConfigError, match="itomp"):
        find_variant("chomp")


def test_options_that_do_not_go_together_are_refused():
    with pytest.raises(ConfigError, match="per_step"):
        PtompConfig(update_smoothing=True)
    with pytest.raises(ConfigError, match="margin_growth"):
        PtompConfig(margin_growth=0.1, kappa=0.0, kappa_min=0.0)


def _collision(growth, kappa=0.5, growth_in_force=None):
    model = CostModel(ROBOT, PtompConfig(margin_growth=growth), None)
    people = HumanForecast(0.0, 0.1, ARM[None], np.zeros((1, 4)), np.full(3, 0.05))
    model.bind(0.03 * np.arange(-2.0, 40.0), np.zeros(3), [people], 0.05, kappa, growth_in_force)
    q = np.radians([0.0, -25.0, 0.0, 90.0, 0.0, -40.0, 0.0])
    return float(model.evaluate(np.tile(q[:, None], (1, 1, 42)))[1][0, 0])


def test_the_margin_grows_with_the_horizon_whatever_kappa_is():
    costs = [_collision(growth) for growth in (0.0, 0.05, 0.1, 0.3)]
    assert costs == sorted(costs)
    assert costs[0] < costs[-1]
    assert _collision(0.1, 0.1) == pytest.approx(_collision(0.1), rel=1e-9)


def test_all_that_widens_the_margin_shrinks_when_overdue():
    """Else a robot whose margins grow with the horizon would wait for ever."""
    config = find_variant("itomp_timing").config
    late = 0.3 + config.margin_patience
    assert margin_in_force(config, -1.0) == (config.margin, config.kappa, config.margin_growth)
    least = (config.margin_min, config.kappa_min, 0.0)
    assert margin_in_force(config, late) == pytest.approx(least)
    halfway = margin_in_force(config, 0.3 + config.margin_patience / 2.0)
    assert halfway[2] == pytest.approx(config.margin_growth / 2.0)
    assert _collision(0.1, growth_in_force=0.05) == pytest.approx(_collision(0.05), rel=1e-9)


def test_a_planner_that_is_not_interleaved_plans_once():
    config = find_variant("stomp").config
    planner = PtompPlanner(ROBOT, config, np.random.default_rng(0))
    people = HumanForecast(0.0, 0.1, ARM[None], np.full((1, 4), 0.01), np.full(3, 0.05))
    start = np.radians([-40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0])
    goal = ROBOT.frames(np.radians([40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0]))[3]
    planner.start(start, np.zeros(7), goal, 1.5, 0.0)
    before = planner.snapshot()
    first = planner.replan(0.0, [people], iterations=20)
    later = planner.replan(0.3, [people], iterations=20)
    assert first.iterations > 0
    assert later.iterations == 0
    times = np.linspace(0.3, 1.5, 20)
    np.testing.assert_allclose(later.plan.sample(times)[0], first.plan.sample(times)[0], atol=1e-9)
    planner.restore(before)  # a plan that never took effect does not count
    assert planner.replan(0.0, [people], iterations=20).iterations > 0
