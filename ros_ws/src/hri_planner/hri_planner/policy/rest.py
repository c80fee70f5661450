"""How joints come to rest when nothing more is planned: all at once, those near a limit sooner.

Each joint's speed falls as v (1 - 3 s² + 2 s³) with s = t / T: no jump of the acceleration at the end,
and the joint never turns back. On the way it gains v T / 2 and slows down by at most 1.5 v / T.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_LEAST_STOP_S = 0.1
_KNOTS = 6
LIMIT_MARGIN = 0.002
"""Joints come to rest so far before their limits: they follow with an error [rad]."""


def coming_to_rest(
    q: FloatArray, qd: FloatArray, acceleration: float, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Knots of the way to rest.

    Args:
        q: Joint angles in the beginning (n,) [rad].
        qd: Joint speeds then (n,) [rad/s].
        acceleration: With which joints can brake [rad/s²]; on average half of it is used, except
            where the limits are nearer.
        lower: Limits of the angles (n,) [rad].
        upper: Limits of the angles (n,) [rad].

    Returns:
        Times from the beginning (k,) [s], angles (k, n), speeds (k, n), accelerations (k, n); without
        the beginning itself, the last at rest. Within the limits, by :data:`LIMIT_MARGIN`, as long as
        constant braking with ``acceleration`` is.
    """
    speed = np.abs(qd)
    common = max(_LEAST_STOP_S, 2.0 * float(speed.max()) / acceleration)
    room = np.maximum(np.where(qd > 0.0, upper - q, q - lower) - LIMIT_MARGIN, 0.0)
    moving = speed > 1e-12
    own = np.full(len(q), common)
    own[moving] = np.clip(2.0 * room[moving] / speed[moving], speed[moving] / acceleration, common)
    times = np.union1d(np.linspace(0.0, common, _KNOTS + 1)[1:], own)
    # Knots that nearly coincide are one; rest is reached at the later of them.
    times = times[np.append(np.diff(times) > 1e-4, True)]
    s = np.minimum(times[:, None] / own, 1.0)
    return (
        times,
        np.clip(q + qd * own * (s - s**3 + 0.5 * s**4), lower, upper),
        qd * (1.0 - 3.0 * s**2 + 2.0 * s**3),
        qd / own * (6.0 * s**2 - 6.0 * s),
    )
