"""The minimum-jerk profile of hands from rest to rest (T. Flash, N. Hogan, J. Neurosci. 5(7), 1985)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def minimum_jerk(phases: ArrayLike) -> NDArray[np.float64]:
    """Share of the way at phases (...), 0 to 1, held at both ends: (...)."""
    z = np.clip(np.asarray(phases, dtype=float), 0.0, 1.0)
    share: NDArray[np.float64] = z * z * z * (10.0 + z * (-15.0 + 6.0 * z))
    return share
