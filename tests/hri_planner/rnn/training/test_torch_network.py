"""The network in torch does what the one in NumPy does."""

import numpy as np
import pytest
import torch

from hri_planner.rnn.activation import triple_tanh as plain_triple_tanh
from hri_planner.rnn.cells import GATES
from hri_planner.rnn.network import new_network
from hri_planner.rnn.training.flat import flatten, unflatten
from hri_planner.rnn.training.torch_network import TorchNetwork, triple_tanh


@pytest.mark.parametrize("kind", GATES)
def test_sequences_are_equal(kind: str) -> None:
    rng = np.random.default_rng(0)
    plain = new_network(kind, (6, 4), rng)
    inputs = rng.normal(size=(5, 30, 6))
    found = TorchNetwork(plain).sequence(torch.tensor(inputs.transpose(1, 0, 2)))
    wanted = plain.sequence(inputs)
    np.testing.assert_allclose(found.detach().numpy().transpose(1, 0, 2), wanted, atol=1e-12)
    single = TorchNetwork(plain, torch.float32).sequence(
        torch.tensor(inputs.transpose(1, 0, 2), dtype=torch.float32)
    )
    np.testing.assert_allclose(single.detach().numpy().transpose(1, 0, 2), wanted, atol=1e-5)


@pytest.mark.parametrize("kind", GATES)
def test_steps_are_the_sequence(kind: str) -> None:
    rng = np.random.default_rng(1)
    network = TorchNetwork(new_network(kind, (4, 5), rng))
    inputs = torch.tensor(rng.normal(size=(9, 3, 6)))
    states = network.initial_states(3, torch.float64)
    outputs = []
    for x in inputs:
        told, states = network.step(x, states)
        outputs.append(told)
    torch.testing.assert_close(torch.stack(outputs), network.sequence(inputs))


def test_triple_tanh_is_the_plain_one() -> None:
    x = np.linspace(-4.0, 4.0, 41)
    np.testing.assert_allclose(triple_tanh(torch.tensor(x)).numpy(), plain_triple_tanh(x))


@pytest.mark.parametrize("kind", GATES)
def test_weights_go_there_and_back(kind: str) -> None:
    plain = new_network(kind, (3, 3), np.random.default_rng(2))
    arrays = TorchNetwork(plain).network().to_arrays()
    for name, values in plain.to_arrays().items():
        np.testing.assert_array_equal(arrays[name], values)
    vector = flatten(arrays)
    assert vector.size == sum(values.size for values in arrays.values())
    for name, values in unflatten(vector, arrays).items():
        np.testing.assert_array_equal(values, arrays[name])
    other = TorchNetwork(new_network(kind, (3, 3), np.random.default_rng(3)))
    other.load({name: torch.tensor(values) for name, values in arrays.items()})
    np.testing.assert_array_equal(other.network().weight, plain.weight)
    assert all(weight.requires_grad for weight in other.weights.values())
