r"""Normalised Gaussian basis functions over the phase of a movement (thesis eqs. 3.1-3.2).

.. math:: \phi_i(z) = \frac{b_i(z)}{\sum_j b_j(z)}, \qquad
          b_i(z) = \exp\left(-\frac{(z - c_i)^2}{2 h}\right)

Centres are spread evenly over :math:`z \in [0, 1]`; the variance :math:`h` follows from where
neighbours overlap, as in ``movement_primitives``, so that weights of both can be exchanged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PhaseBasis:
    r"""The basis :math:`\phi(z)` of one dimension.

    Args:
        count: Number W of functions, at least 2. More follow sharper motion, but need more
            demonstrations; 8 describe a reach to about a millimetre.
        overlap: In (0, 1); larger values make wider, smoother functions.

    Raises:
        ConfigError: if a value is outside its range.
    """

    count: int = 8
    overlap: float = 0.7

    def __post_init__(self) -> None:
        if self.count < 2:
            raise ConfigError(f"PhaseBasis.count = {self.count}", expected="at least 2")
        if not 0.0 < self.overlap < 1.0:
            raise ConfigError(f"PhaseBasis.overlap = {self.overlap}", expected="0 < overlap < 1")

    @property
    def centres(self) -> Array:
        """Phases of the peaks before normalisation, (W,)."""
        return np.linspace(0.0, 1.0, self.count)

    @property
    def variance(self) -> float:
        """Variance h of the Gaussians, in squared phase."""
        return -1.0 / (8.0 * self.count**2 * math.log(self.overlap))

    def values(self, phases: ArrayLike) -> Array:
        """Activations at ``phases`` (...,): (..., W), rows sum to one."""
        offset = np.asarray(phases, dtype=float)[..., None] - self.centres
        exponent = -(offset**2) / (2.0 * self.variance)
        activation = np.exp(exponent - exponent.max(axis=-1, keepdims=True))
        normalised: Array = activation / activation.sum(axis=-1, keepdims=True)
        return normalised

    def derivatives(self, phases: ArrayLike) -> Array:
        """Derivatives with respect to the phase at ``phases`` (...,): (..., W), rows sum to zero.

        A time derivative is this divided by the duration of the movement.
        """
        value = self.values(phases)
        slope = (self.centres - np.asarray(phases, dtype=float)[..., None]) / self.variance
        derivative: Array = value * (slope - np.sum(value * slope, axis=-1, keepdims=True))
        return derivative


@njit
def basis_row(phase: float, centres: Array, variance: float, out: Array) -> None:
    """Write the activations at one phase into ``out`` (W,): compiled `PhaseBasis.values`."""
    count = centres.shape[0]
    largest = -1e300
    for i in range(count):
        out[i] = -((phase - centres[i]) ** 2) / (2.0 * variance)
        largest = max(largest, out[i])
    total = 0.0
    for i in range(count):
        out[i] = math.exp(out[i] - largest)
        total += out[i]
    for i in range(count):
        out[i] /= total
