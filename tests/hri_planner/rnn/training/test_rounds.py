"""Rounds of both stages, and how one goes on from the other."""

from dataclasses import replace

import numpy as np
import pytest
from encounters import some_encounters

from hri_planner.rnn.cells import GATES
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.network import new_network
from hri_planner.rnn.training.adam import adam_round
from hri_planner.rnn.training.batches import (
    buckets,
    course,
    training_scales,
)
from hri_planner.rnn.training.closed_loop import closed_round, horizon, rates
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.imitation import imitation_round
from hri_planner.rnn.training.losses import imitation_loss
from hri_planner.rnn.training.torch_network import TorchNetwork

FEATURES = FeatureConfig()
ENCOUNTERS = some_encounters(8)
SCALES = training_scales(ENCOUNTERS, FEATURES)
DATA = buckets(ENCOUNTERS, SCALES, FEATURES, hold=4)


def fresh(kind: str = "gru") -> TorchNetwork:
    return TorchNetwork(new_network(kind, (4, 3), np.random.default_rng(0)))


def weights(network: TorchNetwork) -> np.ndarray:
    arrays = network.network().to_arrays()
    return np.concatenate([arrays[name].ravel() for name in sorted(arrays)])


@pytest.mark.parametrize("kind", GATES)
def test_rounds_of_bfgs_lower_the_loss(kind: str) -> None:
    config = TrainingConfig(cell=kind, imitation_iterations=8)
    network = fresh(kind)
    losses = [float(imitation_loss(network, DATA).detach())]
    memory: dict[str, np.ndarray] = {}
    for _ in range(3):
        loss, memory = imitation_round(network, memory, DATA, config)
        # What is told is what the weights that were left behind do.
        assert float(imitation_loss(network, DATA).detach()) == pytest.approx(loss, rel=1e-9)
        losses.append(loss)
    assert losses == sorted(losses, reverse=True)
    assert losses[-1] < 0.6 * losses[0]
    inverse = memory["inverse_hessian"]
    np.testing.assert_array_equal(inverse, inverse.T)
    assert np.linalg.eigvalsh(inverse).min() > 0.0


def test_bfgs_goes_on_with_what_it_knows_of_the_curvature() -> None:
    config = TrainingConfig(imitation_iterations=10)
    found = []
    for forgets in (False, True):
        network = fresh()
        loss, memory = imitation_round(network, {}, DATA, config)
        loss, _ = imitation_round(network, {} if forgets else memory, DATA, config)
        found.append(loss)
    assert found[0] < found[1]


def test_adam_in_two_rounds_is_adam_in_one() -> None:
    steps = 0.01 * np.linspace(1.0, 0.5, 12)
    whole, parts = fresh(), fresh()
    adam_round(whole.weights, {}, lambda _: imitation_loss(whole, DATA), steps, 0.05)
    memory: dict[str, np.ndarray] = {}
    for part in (steps[:5], steps[5:]):
        _, memory = adam_round(
            parts.weights, memory, lambda _: imitation_loss(parts, DATA), part, 0.05
        )
    np.testing.assert_array_equal(weights(whole), weights(parts))
    assert memory["step"] == 12.0
    forgetful = fresh()
    for part in (steps[:5], steps[5:]):
        adam_round(forgetful.weights, {}, lambda _: imitation_loss(forgetful, DATA), part, 0.05)
    assert np.abs(weights(forgetful) - weights(whole)).max() > 1e-6


def test_adam_lowers_the_loss_of_either_stage() -> None:
    config = TrainingConfig(
        optimiser="adam", imitation_iterations=30, closed_iterations=25, batch=8,
        first_horizon=30, last_horizon=30,
    )  # fmt: skip
    network = fresh()
    first = float(imitation_loss(network, DATA).detach())
    imitation_round(network, {}, DATA, config)
    assert float(imitation_loss(network, DATA).detach()) < first
    moved = course(ENCOUNTERS, 30)
    rng = np.random.default_rng(3)
    losses, memory = [], {}
    for round_ in range(3):
        loss, memory = closed_round(network, memory, moved, SCALES, FEATURES, config, round_, rng)
        losses.append(loss)
    assert losses[-1] < 0.8 * losses[0]


def test_horizon_and_rates_go_from_end_to_end() -> None:
    config = TrainingConfig(closed_rounds=5, first_horizon=60, last_horizon=200)
    steps = [horizon(round_, config) for round_ in range(5)]
    assert (steps[0], steps[-1]) == (60, 200)
    assert steps == sorted(steps)
    all_ = np.concatenate([rates(round_, config) for round_ in range(5)])
    assert all_[0] == pytest.approx(config.closed_rate)
    assert all_[-1] == pytest.approx(0.02 * config.closed_rate, rel=0.02)
    assert (np.diff(all_) < 0.0).all()
    single = replace(config, closed_rounds=1)
    assert horizon(0, single) == 60
