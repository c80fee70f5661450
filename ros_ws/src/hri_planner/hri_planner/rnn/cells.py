"""The recurrent cells (eq. 5.1-5.10): LSTM, GRU and GRU with triple-tanh.

With x the input, y the output, σ the logistic function, φ tanh or triple-tanh, ⊙ by elements:

    LSTM (Hochreiter & Schmidhuber 1997; Gers 2000)      GRU (Cho et al. 2014)
    i = σ(W_i x + U_i y + b_i)                           r = σ(W_r x + U_r y + b_r)
    f = σ(W_f x + U_f y + b_f + 1)                       z = σ(W_z x + U_z y + b_z)
    o = σ(W_o x + U_o y + b_o)                           h = φ(W_h x + U_h (r ⊙ y) + b_h)
    c ← f ⊙ c + i ⊙ φ(W_c x + U_c y + b_c)               y ← z ⊙ y + (1 - z) ⊙ h
    y ← o ⊙ φ(c)

The reset comes before the recurrent product, which torch.nn.GRU does the other way round. Weights of
all gates are stacked in the order of :data:`GATES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.activation import sigmoid, triple_tanh
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]

GATES = {
    "lstm": ("input", "forget", "output", "candidate"),
    "gru": ("reset", "update", "candidate"),
    "gru3t": ("reset", "update", "candidate"),
}
"""Kinds of cells, and the gates of each in the order of their weights."""

FORGET_BIAS = 1.0
"""Added to the forget gate's argument, so that a new LSTM keeps what it knows."""


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer of cells.

    Attributes:
        kind: One of :data:`GATES`.
        inputs: Weights of the input (gates · units, n).
        recurrent: Weights of the layer's own output (gates · units, units).
        bias: Shape (gates · units,).
    """

    kind: str
    inputs: FloatArray
    recurrent: FloatArray
    bias: FloatArray

    @property
    def units(self) -> int:
        """Number of outputs."""
        return self.recurrent.shape[1]

    @property
    def state_size(self) -> int:
        """Numbers that it remembers: y, and c of an LSTM."""
        return 2 * self.units if self.kind == "lstm" else self.units

    def step(self, x: FloatArray, state: FloatArray) -> FloatArray:
        """The state after an input.

        Args:
            x: Input (..., n).
            state: y, and c of an LSTM behind it (..., state_size).

        Returns:
            New state (..., state_size); its first ``units`` numbers are the output.
        """
        return (_lstm if self.kind == "lstm" else _gru)(self, x, state)


def _lstm(layer: Layer, x: FloatArray, state: FloatArray) -> FloatArray:
    n = layer.units
    y, c = state[..., :n], state[..., n:]
    found = x @ layer.inputs.T + y @ layer.recurrent.T + layer.bias
    found[..., n : 2 * n] += FORGET_BIAS
    gates = sigmoid(found[..., : 3 * n])
    enter, keep, leave = gates[..., :n], gates[..., n : 2 * n], gates[..., 2 * n :]
    memory = keep * c + enter * np.tanh(found[..., 3 * n :])
    return np.concatenate((leave * np.tanh(memory), memory), axis=-1)


def _gru(layer: Layer, x: FloatArray, y: FloatArray) -> FloatArray:
    n = layer.units
    activation: Callable[[FloatArray], FloatArray] = (
        triple_tanh if layer.kind == "gru3t" else np.tanh
    )
    found = x @ layer.inputs.T + layer.bias
    gates = sigmoid(found[..., : 2 * n] + y @ layer.recurrent[: 2 * n].T)
    reset, keep = gates[..., :n], gates[..., n:]
    new = activation(found[..., 2 * n :] + (reset * y) @ layer.recurrent[2 * n :].T)
    return keep * y + (1.0 - keep) * new


def new_layer(kind: str, n_inputs: int, units: int, rng: np.random.Generator) -> Layer:
    """A layer to be trained: Glorot and Bengio's uniform weights, gate by gate.

    Biases are zero, but for one at a GRU's reset and update gates (section 5.3.5).

    Raises:
        ConfigError: on an unknown kind, or fewer than one unit.
    """
    if kind not in GATES:
        raise ConfigError(f"cell {kind!r}", expected="one of " + ", ".join(GATES))
    if units < 1 or n_inputs < 1:
        raise ConfigError(f"{n_inputs} inputs, {units} units", expected="at least one of both")
    gates = len(GATES[kind])
    inputs = [glorot(units, n_inputs, rng) for _ in range(gates)]
    recurrent = [glorot(units, units, rng) for _ in range(gates)]
    bias = np.zeros(gates * units)
    if kind != "lstm":
        bias[: 2 * units] = 1.0
    return Layer(kind, np.concatenate(inputs), np.concatenate(recurrent), bias)


def glorot(rows: int, columns: int, rng: np.random.Generator) -> FloatArray:
    """Weights (rows, columns), uniform within ± sqrt(6 / (rows + columns)) (Glorot & Bengio 2010)."""
    limit = np.sqrt(6.0 / (rows + columns))
    return rng.uniform(-limit, limit, (rows, columns))
