"""The network of :mod:`hri_planner.rnn.network` in torch, where it can be differentiated.

Weights have the same names and shapes; what a trained network does in NumPy is equal to 1e-6.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from hri_planner.rnn.activation import TRIPLE_OFFSETS, TRIPLE_SCALE
from hri_planner.rnn.cells import FORGET_BIAS
from hri_planner.rnn.network import Network


def triple_tanh(x: Tensor) -> Tensor:
    """Triple-tanh (eq. 5.11)."""
    parts = [torch.tanh(TRIPLE_SCALE * (x - offset)) for offset in TRIPLE_OFFSETS]
    return (parts[0] + parts[1] + parts[2]) / len(parts)


class TorchNetwork:
    """A network whose weights are tensors.

    Args:
        network: Where it begins.
        dtype: Of its numbers.
    """

    def __init__(self, network: Network, dtype: torch.dtype = torch.float64) -> None:
        self.kind, self.units = network.kind, network.units
        self.weights = {
            name: torch.tensor(values, dtype=dtype, requires_grad=True)
            for name, values in network.to_arrays().items()
        }

    def network(self) -> Network:
        """The same in NumPy."""
        arrays = {
            name: values.detach().double().numpy().copy() for name, values in self.weights.items()
        }
        return Network.from_arrays(arrays, self.kind, self.units)

    def load(self, arrays: Mapping[str, Tensor]) -> None:
        """Take over weights."""
        with torch.no_grad():
            for name, values in self.weights.items():
                values.copy_(arrays[name])

    def sequence(self, inputs: Tensor) -> Tensor:
        """Outputs for features that are known beforehand.

        Args:
            inputs: Normalised features (steps, batch, N_INPUTS).

        Returns:
            Normalised accelerations (steps, batch, N_OUTPUTS).
        """
        below = inputs
        for index in range(len(self.units)):
            # What does not wait for the step before is one product for all steps.
            given = below @ self.weights[f"inputs_{index}"].T + self.weights[f"bias_{index}"]
            state = self.initial_state(index, inputs.shape[1], inputs.dtype)
            outputs = []
            for step in given.unbind():
                state = self._step(index, step, state)
                outputs.append(state[0])
            below = torch.stack(outputs)
        return below @ self.weights["weight"].T + self.weights["bias"]

    def step(
        self, x: Tensor, states: list[tuple[Tensor, ...]]
    ) -> tuple[Tensor, list[tuple[Tensor, ...]]]:
        """One step of all layers: normalised accelerations (batch, N_OUTPUTS), and new states."""
        after = []
        for index, state in enumerate(states):
            given = torch.addmm(self.weights[f"bias_{index}"], x, self.weights[f"inputs_{index}"].T)
            new = self._step(index, given, state)
            after.append(new)
            x = new[0]
        return torch.addmm(self.weights["bias"], x, self.weights["weight"].T), after

    def initial_states(self, batch: int, dtype: torch.dtype) -> list[tuple[Tensor, ...]]:
        """What all layers remember before a sequence."""
        return [self.initial_state(index, batch, dtype) for index in range(len(self.units))]

    def initial_state(self, index: int, batch: int, dtype: torch.dtype) -> tuple[Tensor, ...]:
        """What a layer remembers before a sequence: y, and c of an LSTM."""
        count = 2 if self.kind == "lstm" else 1
        return tuple(torch.zeros(batch, self.units[index], dtype=dtype) for _ in range(count))

    def _step(self, index: int, given: Tensor, state: tuple[Tensor, ...]) -> tuple[Tensor, ...]:
        """New state of a layer, of what its input gives to the gates (batch, gates · units)."""
        recurrent, n = self.weights[f"recurrent_{index}"], self.units[index]
        y = state[0]
        if self.kind == "lstm":
            found = torch.addmm(given, y, recurrent.T)
            enter, keep, leave, new = found.split(n, dim=1)
            memory = torch.sigmoid(keep + FORGET_BIAS) * state[1] + torch.sigmoid(
                enter
            ) * torch.tanh(new)
            return torch.sigmoid(leave) * torch.tanh(memory), memory
        gates = torch.sigmoid(torch.addmm(given[:, : 2 * n], y, recurrent[: 2 * n].T))
        reset, keep = gates.split(n, dim=1)
        candidate = torch.addmm(given[:, 2 * n :], reset * y, recurrent[2 * n :].T)
        new = triple_tanh(candidate) if self.kind == "gru3t" else torch.tanh(candidate)
        return (torch.lerp(new, y, keep),)
