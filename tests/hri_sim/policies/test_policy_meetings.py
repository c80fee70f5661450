"""Closed loops of policies and partners who answer them."""

import numpy as np
import pytest

from hri_planner.policy.separation import SeparationConfig
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.network import Network, new_network
from hri_planner.rnn.scales import Scales
from hri_sim.dyads.hands import LAWS, STEP_S, moving, simulate
from hri_sim.dyads.setups import draw_setups
from hri_sim.policies import meetings
from hri_sim.policies.meetings import chased, draw_many, joined, meet, taken

SECONDS = 2.0


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meetings, "SECONDS", SECONDS)


@pytest.fixture
def reaches():
    rng = np.random.default_rng(1)
    drawn = draw_many(draw_setups(3, rng), 6, rng)
    apart = np.linalg.norm(drawn.start[:, 0] - drawn.start[:, 1], axis=1)
    return taken(drawn, apart > 0.12)


def resting() -> PolicyModel:
    """A policy that wants nothing."""
    network = new_network("gru", (2,), np.random.default_rng(0))
    still = Network(network.layers, np.zeros((3, 2)), np.zeros(3))
    return PolicyModel(still, Scales(0.3, 5.0, 3.0), FeatureConfig())


def test_a_learner_that_is_moved_as_it_would_move_changes_nothing(reaches) -> None:
    both = simulate(reaches, SECONDS, np.random.default_rng(5))
    again = moving(
        reaches, SECONDS, np.random.default_rng(5), lambda step, partner: both[:, step, 0]
    )
    np.testing.assert_array_equal(np.stack(list(again), axis=1), both)


def test_partners_answer_the_hand_that_the_policy_moves(reaches) -> None:
    beside = {
        law: meet(resting(), reaches.with_partner(law), np.random.default_rng(5)) for law in LAWS
    }
    human = simulate(reaches.with_partner("push"), SECONDS, np.random.default_rng(5))
    every = beside["push"].partner.shape[1]
    assert every == len(np.arange(0, human.shape[1], 8))
    # Who does not give way is not told from its own simulation, all others are.
    alone = simulate(reaches.with_partner("none"), SECONDS, np.random.default_rng(5))
    unheeding = 0.5 * (alone[:, 7:-1:8, 1] + alone[:, 8::8, 1])
    np.testing.assert_allclose(beside["none"].partner[:, 1:], unheeding, atol=1e-12)
    beside_people = 0.5 * (human[:, 7:-1:8, 1] + human[:, 8::8, 1])
    assert np.abs(beside["push"].partner[:, 1:] - beside_people).max() > 1e-3
    np.testing.assert_array_equal(beside["none"].hand[:, -1], reaches.start[:, 0])


def test_the_filter_keeps_the_separation_without_which_it_is_lost(reaches) -> None:
    config = SeparationConfig()
    most = config.partner_acceleration * (1.0 - 1e-9)
    without = chased(resting(), reaches, None, 1.5, most)
    kept = chased(resting(), reaches, config, 1.5, most)
    assert without.nearest.max() < config.separation
    assert kept.nearest.min() >= config.separation - 1e-9
    assert kept.partner_acceleration.max() <= config.partner_acceleration
    speed = np.linalg.norm(np.diff(kept.partner, axis=1), axis=2) / (8 * STEP_S)
    assert speed.max() <= 1.5 + 1e-9
    assert (kept.filtered > 0.0).all()
    assert not without.filtered.any()


def test_parts_are_joined_in_their_order(reaches) -> None:
    parts = [taken(reaches, np.arange(2)), taken(reaches, np.arange(2, 5))]
    np.testing.assert_array_equal(joined(parts).goal, reaches.goal[:5])
