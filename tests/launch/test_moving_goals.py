"""Demo scenes whose goals move."""

import numpy as np
import pytest

from hri_planner.policy.partner import Partner
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.model import load_robot
from hri_sim.launch.moving_goals import (
    CLEAR_M,
    HANDOVER_M,
    RAISED_M,
    SCENES,
    SWITCH_AFTER_S,
    draw_scene,
)


@pytest.mark.parametrize("name", sorted(SCENES))
def test_a_scene_has_as_many_reaches_as_are_asked_for(name: str) -> None:
    scene = draw_scene(name, 3, 2)
    assert len(scene.scenario.reaches) == 2
    assert (scene.leader is None) == (name == "sequence")


def test_goals_are_switched_in_mid_flight_to_places_within_reach() -> None:
    scene, robot = draw_scene("switch", 3, 2), load_robot()
    assert scene.leader is not None
    for index, reach in enumerate(scene.scenario.reaches):
        assert scene.leader(index, SWITCH_AFTER_S - 0.01, None) is None
        later = scene.leader(index, SWITCH_AFTER_S, None)
        assert later is not None
        assert np.linalg.norm(later - scene.scenario.targets[reach.robot_target]) > 0.1
        solve_ik(robot, later, np.zeros(7), np.random.default_rng(0))


@pytest.mark.parametrize("seed", [3, 7, 11, 12])
def test_goals_are_not_switched_to_where_the_person_s_arm_comes_to_rest(seed: int) -> None:
    scene = draw_scene("switch", seed, 3)
    assert scene.leader is not None
    for index, reach in enumerate(scene.scenario.reaches):
        later = scene.leader(index, SWITCH_AFTER_S, None)
        person = scene.scenario.person_of(index)
        assert later is not None
        assert reach.person_target is not None
        arm = person.arm.posture(scene.scenario.targets[reach.person_target], person.swivel)
        resting = Partner(arm[3], np.zeros(3), joints=arm, speeds=0.0 * arm)
        assert resting.distance(later) >= CLEAR_M


@pytest.mark.parametrize("seed", range(4))
def test_things_are_held_out_where_the_robot_gets_at_them(seed: int) -> None:
    scene, robot = draw_scene("handover", seed, 2), load_robot()
    assert scene.leader is not None
    assert scene.leader(0, 1.0, None) is None
    for index, reach in enumerate(scene.scenario.reaches):
        assert reach.person_target is not None
        hand = np.array(scene.scenario.targets[reach.person_target])
        assert scene.scenario.person_of(index).arm.can_reach(hand)
        held_out_s = reach.person_delay + reach.person_duration
        goal, before = (scene.leader(index, held_out_s + off_s, hand) for off_s in (0.1, -0.1))
        assert goal is not None
        assert before is not None
        assert np.linalg.norm(goal - hand) == pytest.approx(HANDOVER_M)
        # Nobody's reach is over before the hand is held out.
        assert before - goal == pytest.approx(np.array((0.0, 0.0, RAISED_M)))
        for place in (goal, before):
            solve_ik(robot, place, np.zeros(7), np.random.default_rng(0))
