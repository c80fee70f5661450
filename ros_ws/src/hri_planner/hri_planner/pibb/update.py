"""Policy improvement with black-box optimisation (Stulp & Sigaud 2012): reward-weighted averaging.

The thesis's equations 7.13 to 7.16, with costs put between 0 and 1 within an update, so that how greedy
it is does not depend on their scale::

    P_k = exp(-h (C_k - min C) / (max C - min C)) / sum_k ...
    theta <- theta + sum_k P_k eps_k
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


def probabilities(costs: ArrayLike, greed: float) -> FloatArray:
    """Of roll-outs by their costs (k,); equal when the costs are.

    Args:
        costs: Smaller is better.
        greed: h; 0 counts all the same.

    Raises:
        DataError: when a cost is not finite, or there is none.
    """
    values = np.asarray(costs, dtype=float)
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise DataError(f"costs {values.tolist()}", expected="finite numbers, at least one")
    spread = float(np.ptp(values))
    logits = -greed * (values - values.min()) / spread if spread > 0.0 else np.zeros_like(values)
    found = np.exp(logits - np.logaddexp.reduce(logits))
    return found / found.sum()


def improved(
    weights: FloatArray, changes: FloatArray, costs: ArrayLike, greed: float
) -> FloatArray:
    """Weights after an update.

    Args:
        weights: Before (3, n) [m].
        changes: Of each roll-out (k, 3, n) [m]; the mean's is zero.
        costs: Of each (k,).
        greed: h.

    Raises:
        DataError: when a cost is not finite, or shapes do not fit.
    """
    share = probabilities(costs, greed)
    if changes.shape != (len(share), *weights.shape):
        raise DataError(
            f"changes of shape {changes.shape}", expected=f"{(len(share), *weights.shape)}"
        )
    better: FloatArray = weights + np.tensordot(share, changes, 1)
    return better
