"""One step of the transformation system, on all three axes.

With the phase u = t / tau, z = tau dy/dt and the delayed goal g_d (the thesis's equations 7.1 to 7.8,
put right)::

    dz/du   = alpha (beta (g_d - y) - z) + alpha beta s(u) Psi(u) w + tau² phi
    dy/du   = z
    dg_d/du = alpha_g (g - g_d)

which is linear but for the potential field's acceleration phi. With what drives it held for a step it
has an exact solution; the acceleration that leads to that solution's speed is what a step gives, so that
filters may change it, and any part of the arm may integrate it.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.linalg import expm

from hri_prediction.compiled import njit

ALPHA = 50.0
"""Of the spring and damper."""
BETA = ALPHA / 4.0
"""Damped critically."""
ALPHA_G = 15.0
"""Of the delayed goal: slower leaves millimetres at the end, faster begins with a jerk."""

Gains = tuple[float, float, float, float, float]


@functools.lru_cache(maxsize=64)
def step_gains(phase_step: float) -> Gains:
    """Of y - g, z, g_d - g and the drive on the next z, and of g_d - g on itself.

    Args:
        phase_step: Control period as a share of the duration.
    """
    matrix = np.zeros((4, 4))
    matrix[0, 1] = 1.0
    matrix[1] = (-ALPHA * BETA, -ALPHA, ALPHA * BETA, 1.0)
    matrix[2, 2] = -ALPHA_G
    solved = expm(matrix * phase_step)
    return (
        float(solved[1, 0]),
        float(solved[1, 1]),
        float(solved[1, 2]),
        float(solved[1, 3]),
        float(solved[2, 2]),
    )


@njit
def next_rate(offset: float, rate: float, lag: float, drive: float, gains: Any) -> float:
    """The next z of one axis.

    Args:
        offset: y - g [m].
        rate: z [m].
        lag: g_d - g [m].
        drive: alpha beta s Psi w + tau² phi [m].
        gains: Of :func:`step_gains`.
    """
    return gains[0] * offset + gains[1] * rate + gains[2] * lag + gains[3] * drive
