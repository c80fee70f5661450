"""Replans beside the executor: when what is planned ahead may be taken, and when it is given up."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.nodes.replanning import Cycle, Replanning
from hri_planner.ptomp.variants import find_variant
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.model import load_robot
from hri_planner.ros.inputs import Inputs
from hri_planner.supervision.decision import Goal, Interval

ROBOT = load_robot()
MS = 1_000_000
GOAL = Goal(np.array([0.45, 0.35, 0.2]), 1.5)
AHEAD = Interval(0, 1500 * MS, 1, GOAL, ahead=True)


@pytest.fixture
def replanning() -> Iterator[Replanning]:
    """That of stomp, live, on a clock that stands at 0."""
    inputs = Inputs(radii=PtompNodeConfig().radii)
    inputs.q = solve_ik(ROBOT, np.array([0.45, -0.35, 0.2]), np.zeros(7), np.random.default_rng(0))
    found = Replanning(
        ROBOT,
        PtompNodeConfig(variant="stomp"),
        find_variant("stomp").config,
        inputs,
        tick_s=0.004,
        lockstep=False,
        now_ns=lambda: 0,
    )
    found.start(GOAL, AHEAD.handover_ns)
    yield found
    found.worker.close()


def planned(replanning: Replanning) -> Cycle:
    assert replanning.submit(AHEAD)
    until = time.monotonic() + 20.0
    while replanning.worker.busy and time.monotonic() < until:
        time.sleep(0.002)
    assert replanning.take(AHEAD.handover_ns - 37 * MS) is None
    made = replanning.take(AHEAD.handover_ns - 36 * MS)
    assert isinstance(made, Cycle)
    return made


def test_a_plan_made_ahead_is_taken_when_the_robot_is_about_to_set_off(
    replanning: Replanning,
) -> None:
    assert planned(replanning).result.iterations > 0


def test_what_is_planned_for_a_motion_that_is_over_is_given_up(replanning: Replanning) -> None:
    replanning.abandon(1)
    assert planned(replanning).result.iterations == 0
