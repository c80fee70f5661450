"""A policy at the control rate goes where the network was taught to go."""

import numpy as np
import pytest

from hri_planner.policy.partner import Partner
from hri_planner.policy.runner import PolicyRunner
from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import STEP_S, PolicyModel
from hri_planner.rnn.network import new_network
from hri_planner.rnn.rollout import roll_out
from hri_planner.rnn.scales import Scales
from hri_prediction.errors import DataError

START, GOAL = np.array((0.1, 0.2, 0.3)), np.array((0.4, 0.0, 0.2))
STANDING = Partner(np.array((0.3, 0.25, 0.25)), np.zeros(3))


def policy(kind: str = "gru", acceleration: float = 2.0) -> PolicyModel:
    network = new_network(kind, (9, 9), np.random.default_rng(1))
    return PolicyModel(network, Scales(0.5, 10.0, acceleration), FeatureConfig())


@pytest.mark.parametrize("control", [0.032, 0.004, 0.001])
@pytest.mark.parametrize("kind", ["gru", "gru3t", "lstm"])
def test_halfway_between_steps_the_hand_is_on_the_networks_path(kind: str, control: float) -> None:
    model, steps = policy(kind), 40
    partner = np.broadcast_to(STANDING.position, (1, steps, 3))
    wanted = roll_out(model, START[None], GOAL[None], partner).positions[0]
    runner = PolicyRunner(model, None, control)
    hand = runner.begin(START)
    per_step = round(STEP_S / control)
    for index in range(steps * per_step):
        if index % per_step == 0:
            step = index // per_step
            # The control points before and at this step: the curve is halfway.
            middle = 0.5 * (wanted[max(step - 1, 0)] + wanted[step])
            assert hand.position == pytest.approx(middle, abs=1e-9)
        hand = runner.step(hand, GOAL, [STANDING])


def test_a_hand_can_be_gone_on_from_again() -> None:
    runner = PolicyRunner(policy("lstm"), SeparationConfig(), 0.004)
    hands = [runner.begin(START)]
    for _ in range(60):
        hands.append(runner.step(hands[-1], GOAL, [STANDING]))
    again = hands[21]
    for later in hands[22:]:
        again = runner.step(again, GOAL, [STANDING])
        assert (again.position == later.position).all()
        assert (again.memory == later.memory).all()


def test_the_filter_keeps_the_separation_from_a_partner_in_the_way() -> None:
    config = SeparationConfig(separation=0.12)
    runner = PolicyRunner(
        policy(acceleration=1e-3), config, 0.004
    )  # by itself it stays where it is
    hand, filtered = runner.begin(START), 0
    place = np.array((0.6, 0.2, 0.3))
    for _ in range(1500):
        # Comes for the hand, wherever it is, at walking pace of hands.
        velocity = 0.3 * (hand.position - place) / np.linalg.norm(hand.position - place)
        place = place + 0.004 * velocity
        hand = runner.step(hand, GOAL, [Partner(place, velocity)])
        filtered += hand.filtered
        assert np.linalg.norm(hand.position - place) >= 0.12 - 2e-3
    assert filtered


def test_the_separation_is_kept_from_what_was_seen_a_while_ago() -> None:
    """Observed 60 ms late and extrapolated, of a partner who chases the hand at the edge of its bound."""
    config, late, dt = SeparationConfig(), 15, 0.004
    runner = PolicyRunner(policy(), config, dt)
    for seed in range(4):
        rng = np.random.default_rng(seed)
        hand = runner.begin(START)
        place, speed = START + np.array((0.5, 0.0, 0.0)) + 0.1 * rng.standard_normal(3), np.zeros(3)
        seen = [Partner(place, speed)]
        for _ in range(400):
            push = 30.0 * (hand.position - place) - 3.0 * speed
            push *= min(1.0, config.partner_acceleration / max(float(np.linalg.norm(push)), 1e-9))
            place, speed = place + speed * dt + 0.5 * push * dt**2, speed + push * dt
            seen.append(Partner(place, speed))
            known = seen[max(len(seen) - 1 - late, 0)].later(dt * min(late, len(seen) - 1))
            hand = runner.step(hand, GOAL, [known])
            assert np.linalg.norm(hand.position - place) >= config.separation - 2e-3


def test_the_hand_stays_above_the_floor() -> None:
    runner = PolicyRunner(policy(), None, 0.004, floor=0.25)
    hand = runner.begin(START)
    lowest = np.inf
    for _ in range(1500):
        hand = runner.step(hand, np.array((0.4, 0.0, -0.5)), [])
        lowest = min(lowest, float(hand.position[2]))
    assert lowest >= 0.25 - 1e-9


def test_the_network_sees_the_nearest_of_several_partners() -> None:
    runner = PolicyRunner(policy(), None, 0.032)
    far = Partner(np.array((0.1, 0.2, 0.6)), np.zeros(3))
    alone = runner.step(runner.begin(START), GOAL, [STANDING])
    for partners in ([STANDING, far], [far, STANDING]):
        assert (runner.step(runner.begin(START), GOAL, partners).wanted == alone.wanted).all()


def test_what_cannot_be_used_is_named() -> None:
    with pytest.raises(DataError, match="control period"):
        PolicyRunner(policy(), None, 0.005)
    runner = PolicyRunner(policy(), None, 0.004)
    with pytest.raises(DataError, match="hand at"):
        runner.begin([np.nan, 0.0, 0.0])
    with pytest.raises(DataError, match="goal"):
        runner.step(runner.begin(START), np.array((np.inf, 0.0, 0.0)), [])
    with pytest.raises(DataError, match="partner"):
        runner.step(runner.begin(START), GOAL, [Partner(np.full(3, np.nan), np.zeros(3))])
