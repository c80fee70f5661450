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
        return np.arange(self.count) / (self.count - 1.0)

    @property
    def variance(self) -> float:
        """Variance h of the Gaussians, in squared phase."""
        return -1.0 / (8.0 * self.count**2 * math.log(self.overlap))

    def values(self, phases: ArrayLike) -> Array:
        """Activations at ``phases`` (...,): (..., W), rows sum to one."""
        values, _ = self._evaluate(phases, slopes=False)
        return values

    def derivatives(self, phases: ArrayLike) -> Array:
        """Derivatives with respect to the phase at ``phases`` (...,): (..., W), rows sum to zero.

        A time derivative is this divided by the duration of the movement.
        """
        _, slopes = self._evaluate(phases, slopes=True)
        return slopes

    def _evaluate(self, phases: ArrayLike, slopes: bool) -> tuple[Array, Array]:
        places = np.array(phases, dtype=float)  # a copy: read-only arrays are another type
        shape = (places.size, self.count)
        values, derivatives = np.empty(shape), np.empty(shape if slopes else (0, self.count))
        basis_table(places.ravel(), self.centres, self.variance, values, derivatives)
        shape = (*places.shape, self.count)
        return values.reshape(shape), derivatives.reshape(shape) if slopes else derivatives


@njit
def basis_row(phase: float, centres: Array, variance: float, out: Array) -> None:
    """Write the activations at one phase into ``out`` (W,): compiled `PhaseBasis.values`.

    The centres are evenly spread, so from one function to the next the ratio of activations changes by
    a constant factor: three exponentials, whatever W is. Going outwards from the largest, nothing
    overflows and errors stay below those of rounding.
    """
    count = centres.shape[0]
    gap = (centres[count - 1] - centres[0]) / (count - 1)
    place = (phase - centres[0]) / gap + 0.5
    peak = 0  # also where the phase is no number
    if place >= count - 1.0:
        peak = count - 1
    elif place > 0.0:
        peak = int(place)
    offset = phase - centres[peak]
    factor = math.exp(-gap * gap / variance)
    out[peak] = 1.0
    total = 1.0
    value, ratio = 1.0, math.exp(gap * (offset - 0.5 * gap) / variance)
    for i in range(peak + 1, count):
        value *= ratio
        ratio *= factor
        out[i] = value
        total += value
    value, ratio = 1.0, math.exp(-gap * (offset + 0.5 * gap) / variance)
    for k in range(peak):
        value *= ratio
        ratio *= factor
        out[peak - 1 - k] = value
        total += value
    for i in range(count):
        out[i] /= total


@njit
def slope_row(phase: float, centres: Array, variance: float, values: Array, out: Array) -> None:
    """Write the derivatives by phase into ``out`` (W,), given the activations ``values`` (W,)."""
    mean = 0.0
    for i in range(centres.shape[0]):
        out[i] = (centres[i] - phase) / variance
        mean += values[i] * out[i]
    for i in range(centres.shape[0]):
        out[i] = values[i] * (out[i] - mean)


@njit
def basis_table(
    phases: Array, centres: Array, variance: float, values: Array, slopes: Array
) -> None:
    """Activations (T, W) at ``phases`` (T,), and derivatives by phase unless ``slopes`` is (0, W)."""
    for t in range(phases.shape[0]):
        basis_row(phases[t], centres, variance, values[t])
        if slopes.shape[0] > 0:
            slope_row(phases[t], centres, variance, values[t], slopes[t])
