"""Warming compiles all there is: a reach afterwards compiles nothing."""

import numpy as np
import pytest
from reach_trials import RADII, REST, ROBOT, run_trial

from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner
from hri_planner.warm import warm_kernels
from hri_prediction.compiled import compiled_variants


def _meet_somebody(config):
    """A replan whose plan touches an arm that lies across the robot."""
    planner = PtompPlanner(ROBOT, config, np.random.default_rng(0))
    goal = ROBOT.frames(REST + np.eye(7)[0])[3]
    planner.start(REST, np.zeros(7), goal, 1.0, 0.0)
    arm = ROBOT.frames(REST)[1:4]
    people = HumanForecast(0.0, 0.1, np.vstack((arm, arm[2:]))[None], np.zeros((1, 4)), RADII)
    assert planner.replan(0.04, [people], iterations=3).predicted_first_contact_s == 0.04


@pytest.mark.parametrize("precision", ["double", "single"])
def test_nothing_is_left_to_compile(precision):
    warm_kernels()
    before = compiled_variants()
    config = PtompConfig(precision=precision)
    run_trial(3, config, iterations=5, limit_s=1.0)
    _meet_somebody(config)
    assert compiled_variants() == before
