"""Many hands at once move as each of them would alone."""

import numpy as np
import pytest

from hri_planner.policy.runner import Partner, PolicyRunner
from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.network import new_network
from hri_planner.rnn.scales import Scales
from hri_sim.policies.filtered import GoalNoise, Hands
from hri_sim.policies.meetings import distances

DT = 0.004


def policy(kind: str = "gru3t") -> PolicyModel:
    network = new_network(kind, (5, 4), np.random.default_rng(2))
    return PolicyModel(network, Scales(0.3, 5.0, 3.0), FeatureConfig())


@pytest.mark.parametrize("separation", [None, SeparationConfig()])
@pytest.mark.parametrize("kind", ["gru3t", "lstm"])
def test_hands_move_as_the_runner_moves_one(kind: str, separation: SeparationConfig | None) -> None:
    rng = np.random.default_rng(4)
    model = policy(kind)
    start, goal = rng.uniform(-0.2, 0.2, (2, 3, 3))
    begin = start + rng.uniform(0.08, 0.15, (3, 3))
    drift = 1.5 * (start - begin)
    hands = Hands(model, separation, start, goal, DT)
    runner = PolicyRunner(model, separation, DT)
    alone = [runner.begin(place) for place in start]
    acted = 0
    for step in range(200):
        partner = begin + step * DT * drift
        hands.step(partner[:, None], drift[:, None], np.ones(3, dtype=bool))
        for row in range(3):
            alone[row] = runner.step(alone[row], goal[row], [Partner(partner[row], drift[row])])
            acted += alone[row].filtered
        np.testing.assert_allclose(
            hands.position, [one.position for one in alone], rtol=1e-12, atol=1e-12
        )
        np.testing.assert_array_equal(hands.filtered, [one.filtered for one in alone])
    assert (acted > 0) == (separation is not None)


def test_a_hand_that_is_not_going_rests_and_forgets_nothing() -> None:
    model = policy()
    start, goal = np.zeros((2, 3)), np.full((2, 3), 0.2)
    far = np.full((2, 3), 5.0)
    late = Hands(model, None, start, goal, DT)
    prompt = Hands(model, None, start, goal, DT)
    both = np.ones(2, dtype=bool)
    for _ in range(16):
        late.step(far[:, None], np.zeros((2, 1, 3)), np.array((True, False)))
    np.testing.assert_array_equal(late.position[1], 0.0)
    for _ in range(40):
        late.step(far[:, None], np.zeros((2, 1, 3)), both)
        prompt.step(far[:, None], np.zeros((2, 1, 3)), both)
    np.testing.assert_array_equal(late.position[1], prompt.position[1])
    assert not np.array_equal(late.position[0], prompt.position[0])


def test_noise_is_what_its_seed_says() -> None:
    model = policy()
    paths = []
    for noise in (GoalNoise(0.003, 1), GoalNoise(0.003, 1), GoalNoise(0.003, 2), None):
        hands = Hands(model, None, np.zeros((1, 3)), np.full((1, 3), 0.2), DT, noise)
        for _ in range(24):
            hands.step(np.full((1, 1, 3), 0.1), np.zeros((1, 1, 3)), np.ones(1, dtype=bool))
        paths.append(hands.position[0])
    np.testing.assert_array_equal(paths[0], paths[1])
    assert not np.array_equal(paths[0], paths[2])
    assert not np.array_equal(paths[0], paths[3])


def test_distances_are_from_the_axes_of_limbs() -> None:
    rng = np.random.default_rng(5)
    joints, points = rng.standard_normal((50, 4, 3)), rng.standard_normal((50, 3))
    arms = [Partner(arm[3], np.zeros(3), joints=arm, speeds=0.0 * arm) for arm in joints]
    wanted = [arm.distance(point) for arm, point in zip(arms, points, strict=True)]
    np.testing.assert_allclose(distances(joints, points), wanted, atol=1e-12)
    hands = [
        Partner(arm[3], np.zeros(3)).distance(p) for arm, p in zip(joints, points, strict=True)
    ]
    np.testing.assert_allclose(distances(joints[:, 3:], points), hands, atol=1e-12)
