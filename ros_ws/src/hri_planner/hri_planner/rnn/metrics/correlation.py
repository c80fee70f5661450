"""Which of a policy's states go with which signals (eq. 5.18, figure 5.6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def correlations(states: ArrayLike, signals: ArrayLike) -> FloatArray:
    """Normalised correlation <state, signal> / (|state| |signal|) over time.

    Args:
        states: Shape (steps, n).
        signals: Shape (steps, m).

    Returns:
        Shape (n, m), -1 to 1; 0 where a state or a signal is zero throughout.
    """
    one, other = np.asarray(states, dtype=float), np.asarray(signals, dtype=float)
    size = np.outer(np.linalg.norm(one, axis=0), np.linalg.norm(other, axis=0))
    found: FloatArray = np.divide(one.T @ other, size, out=np.zeros_like(size), where=size > 0.0)
    return found
