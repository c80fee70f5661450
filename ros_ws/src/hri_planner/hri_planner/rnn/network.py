"""A network: layers of cells, one over the other, and a linear output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.rnn.cells import GATES, Layer, glorot, new_layer
from hri_prediction.errors import ConfigError, DataError, shown

FloatArray = NDArray[np.float64]

N_INPUTS, N_OUTPUTS = 6, 3
MAX_LAYERS = 8


@dataclass(frozen=True, eq=False)
class Network:
    """Layers and what is made of the last one's output.

    Attributes:
        layers: From the input on.
        weight: Of the linear output (N_OUTPUTS, units).
        bias: Of it (N_OUTPUTS,).
    """

    layers: tuple[Layer, ...]
    weight: FloatArray
    bias: FloatArray

    @property
    def kind(self) -> str:
        """Of its cells."""
        return self.layers[0].kind

    @property
    def units(self) -> tuple[int, ...]:
        """Of each layer."""
        return tuple(layer.units for layer in self.layers)

    @property
    def state_size(self) -> int:
        """Numbers that it remembers from step to step."""
        return sum(layer.state_size for layer in self.layers)

    def initial_state(self, *batch: int) -> FloatArray:
        """What it remembers before a sequence: nothing (*batch, state_size)."""
        return np.zeros((*batch, self.state_size))

    def step(self, x: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """One step.

        Args:
            x: Normalised features (..., N_INPUTS).
            state: Of all layers (..., state_size).

        Returns:
            Normalised accelerations (..., N_OUTPUTS), and the new state.
        """
        after = np.empty_like(state)
        begin = 0
        for layer in self.layers:
            end = begin + layer.state_size
            after[..., begin:end] = layer.step(x, state[..., begin:end])
            x = after[..., begin : begin + layer.units]
            begin = end
        return x @ self.weight.T + self.bias, after

    def sequence(self, inputs: ArrayLike) -> FloatArray:
        """Outputs for features that are known beforehand (..., steps, N_INPUTS)."""
        given = np.asarray(inputs, dtype=float)
        state = self.initial_state(*given.shape[:-2])
        found = np.empty((*given.shape[:-1], N_OUTPUTS))
        for index in range(given.shape[-2]):
            found[..., index, :], state = self.step(given[..., index, :], state)
        return found

    def to_arrays(self) -> dict[str, FloatArray]:
        """Weights by name."""
        found = {"weight": self.weight, "bias": self.bias}
        for index, layer in enumerate(self.layers):
            found[f"inputs_{index}"] = layer.inputs
            found[f"recurrent_{index}"] = layer.recurrent
            found[f"bias_{index}"] = layer.bias
        return found

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, FloatArray], kind: str, units: tuple[int, ...]
    ) -> Network:
        """The network that :meth:`to_arrays` took apart.

        Args:
            arrays: By name.
            kind: Of its cells.
            units: Of each layer.

        Raises:
            DataError: when an array is missing, too many, of a wrong shape or type, or not finite.
        """
        shapes = array_shapes(kind, units)
        if set(arrays) != set(shapes):
            raise DataError(f"a network of {shown(sorted(arrays))}", expected=f"{sorted(shapes)}")
        for name, shape in shapes.items():
            values = arrays[name]
            if values.shape != shape or values.dtype != np.float64:
                raise DataError(
                    f"{name} has shape {values.shape}, type {values.dtype}",
                    expected=f"{shape}, float64, for {len(units)} layers of {units} {kind} cells",
                )
            if not np.isfinite(values).all():
                raise DataError(f"{name} holds NaN or infinity")
        layers = tuple(
            Layer(kind, *(arrays[f"{part}_{index}"] for part in ("inputs", "recurrent", "bias")))
            for index in range(len(units))
        )
        return cls(layers, arrays["weight"], arrays["bias"])


def array_shapes(kind: str, units: tuple[int, ...]) -> dict[str, tuple[int, ...]]:
    """Shapes of a network's arrays, by name.

    Raises:
        DataError: on an unknown kind, no layer, or sizes below one.
    """
    if kind not in GATES:
        raise DataError(f"cells of kind {shown(kind)}", expected="one of " + ", ".join(GATES))
    if not 1 <= len(units) <= MAX_LAYERS or min(units) < 1:
        raise DataError(
            f"layers of {shown(units)} units", expected=f"1 to {MAX_LAYERS} of at least 1"
        )
    gates = len(GATES[kind])
    found: dict[str, tuple[int, ...]] = {"weight": (N_OUTPUTS, units[-1]), "bias": (N_OUTPUTS,)}
    for index, (below, size) in enumerate(zip((N_INPUTS, *units), units, strict=False)):
        found[f"inputs_{index}"] = (gates * size, below)
        found[f"recurrent_{index}"] = (gates * size, size)
        found[f"bias_{index}"] = (gates * size,)
    return found


def new_network(kind: str, units: tuple[int, ...], rng: np.random.Generator) -> Network:
    """A network to be trained.

    Raises:
        ConfigError: on an unknown kind, no layer, or sizes below one.
    """
    if not 1 <= len(units) <= MAX_LAYERS:
        raise ConfigError(f"{len(units)} layers", expected=f"1 to {MAX_LAYERS}")
    layers = tuple(
        new_layer(kind, below, size, rng)
        for below, size in zip((N_INPUTS, *units), units, strict=False)
    )
    return Network(layers, glorot(N_OUTPUTS, units[-1], rng), np.zeros(N_OUTPUTS))
