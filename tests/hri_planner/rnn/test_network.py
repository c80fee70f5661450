"""Cells against their equations, written down one number at a time."""

import math

import numpy as np
import pytest

from hri_planner.rnn.cells import GATES, new_layer
from hri_planner.rnn.network import Network, new_network
from hri_prediction.errors import ConfigError, DataError


def sigma(x: float) -> float:
    return 1.0 / (1.0 + math.exp(-x))


def phi(kind: str, x: float) -> float:
    if kind != "gru3t":
        return math.tanh(x)
    return sum(math.tanh(4.0 * (x - p)) for p in (-2.0, 0.0, 2.0)) / 3.0


@pytest.mark.parametrize("kind", GATES)
def test_a_step_is_that_of_the_equations(kind: str) -> None:
    rng = np.random.default_rng(3)
    layer = new_layer(kind, 2, 3, rng)
    x, state = rng.normal(size=2), rng.normal(size=layer.state_size)
    y, c = state[:3], state[3:]

    def argument(gate: str, unit: int, of: np.ndarray) -> float:
        row = GATES[kind].index(gate) * 3 + unit
        return layer.inputs[row] @ x + layer.recurrent[row] @ of + layer.bias[row]

    if kind == "lstm":
        memory = [
            sigma(argument("forget", u, y) + 1.0) * c[u]
            + sigma(argument("input", u, y)) * math.tanh(argument("candidate", u, y))
            for u in range(3)
        ]
        out = [sigma(argument("output", u, y)) * math.tanh(memory[u]) for u in range(3)]
        wanted = [*out, *memory]
    else:
        reset = np.array([sigma(argument("reset", u, y)) for u in range(3)])
        keep = [sigma(argument("update", u, y)) for u in range(3)]
        new = [phi(kind, argument("candidate", u, reset * y)) for u in range(3)]
        wanted = [keep[u] * y[u] + (1.0 - keep[u]) * new[u] for u in range(3)]
    assert layer.step(x, state) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("kind", GATES)
def test_sequences_and_batches_are_steps(kind: str) -> None:
    rng = np.random.default_rng(4)
    network = new_network(kind, (4, 3), rng)
    inputs = rng.normal(size=(2, 7, 6))
    together = network.sequence(inputs)
    for row in range(2):
        state = network.initial_state()
        for index in range(7):
            out, state = network.step(inputs[row, index], state)
            assert out == pytest.approx(together[row, index], abs=1e-12)


def test_first_weights_are_glorots_and_biases_as_wanted() -> None:
    layer = new_layer("gru", 6, 9, np.random.default_rng(0))
    assert np.abs(layer.inputs).max() <= math.sqrt(6.0 / 15.0)
    assert np.abs(layer.inputs).max() > 0.9 * math.sqrt(6.0 / 15.0)
    assert layer.bias.tolist() == [1.0] * 18 + [0.0] * 9
    assert not new_layer("lstm", 6, 9, np.random.default_rng(0)).bias.any()


@pytest.mark.parametrize("kind", GATES)
def test_a_network_taken_apart_is_the_same_again(kind: str) -> None:
    network = new_network(kind, (5, 2), np.random.default_rng(1))
    again = Network.from_arrays(network.to_arrays(), kind, (5, 2))
    x = np.random.default_rng(2).normal(size=(3, 6))
    np.testing.assert_array_equal(network.sequence(x), again.sequence(x))


def test_what_does_not_fit_is_named() -> None:
    arrays = new_network("gru", (4,), np.random.default_rng(0)).to_arrays()
    with pytest.raises(DataError, match=r"recurrent_0 has shape \(12, 4\).*lstm"):
        Network.from_arrays({**arrays, "inputs_0": np.zeros((16, 6))}, "lstm", (4,))
    with pytest.raises(DataError, match="cells of kind 'rnn'"):
        Network.from_arrays(arrays, "rnn", (4,))
    with pytest.raises(DataError, match="a network of"):
        Network.from_arrays({"weight": arrays["weight"]}, "gru", (4,))
    broken = arrays["bias_0"].copy()
    broken[0] = np.inf
    with pytest.raises(DataError, match="bias_0 holds NaN or infinity"):
        Network.from_arrays({**arrays, "bias_0": broken}, "gru", (4,))
    with pytest.raises(ConfigError, match="one of lstm, gru, gru3t"):
        new_network("gpu", (4,), np.random.default_rng(0))
