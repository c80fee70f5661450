r"""When, in what was seen, a hand sets out and comes to rest: fitted to a motion.

Samples are counted by the phase s of all that was seen, from 0 to 1; the motion goes from begin to end of
its span, and rests before and after:

.. math:: p(s) = \hat p(u), \qquad u = (s - a) / (b - a) \text{ within } [0, 1].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.kinematics import hand_jacobian
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import Motion

Array = NDArray[np.float64]
Span = tuple[float, float]
"""Phases at which a motion begins and ends, of what was seen."""

_STEPS = 12
_ENOUGH = 1e-6
"""Changes of phases that make no difference."""
_LARGEST = 0.05
"""A step changes phases by no more than that."""
_HALVES = 6


def within(phases: Array, span: Span) -> Array:
    """Phases (N,) of the motion, 0 before it begins and 1 once it has ended, of what was seen."""
    begin, end = span
    found: Array = np.clip((phases - begin) / (end - begin), 0.0, 1.0)
    return found


def span_derivatives(motion: Motion, seen: ObservedReach, arm: ArmModel, span: Span) -> Array:
    """How the path (N, 3) that belongs to a span moves with its begin and end: (3 N, 2) [m]."""
    begin, end = span
    phases = within(seen.phases, span)
    turning = motion.angles(phases, 1) * motion.duration  # by phase
    path = (hand_jacobian(motion.angles(phases), arm) @ turning[:, :, None])[:, :, 0]
    path[(phases <= 0.0) | (phases >= 1.0)] = 0.0
    shares = np.stack([phases - 1.0, -phases], axis=-1) / (end - begin)
    found: Array = (path[:, :, None] * shares[:, None]).reshape(-1, 2)
    return found


def fitted_span(motion: Motion, seen: ObservedReach, arm: ArmModel, span: Span) -> Span:
    """The span with which a motion is nearest to the path that was seen (least squares).

    Args:
        motion: From rest to rest.
        seen: With some rest before and after.
        arm: The model.
        span: Where to begin.
    """

    def left(of: Span) -> Array:
        return (seen.hand - motion.hand(within(seen.phases, of), arm)).ravel()

    residual = left(span)
    squares = float(residual @ residual)
    for _ in range(_STEPS):
        step, *_ = np.linalg.lstsq(span_derivatives(motion, seen, arm, span), residual, rcond=None)
        step = np.clip(step, -_LARGEST, _LARGEST)
        for _ in range(_HALVES):
            tried = (
                float(np.clip(span[0] + step[0], 0.0, 0.45)),
                float(np.clip(span[1] + step[1], 0.55, 1.0)),
            )
            new = left(tried)
            if float(new @ new) < squares:
                break
            step = 0.5 * step
        else:
            return span
        span, residual, squares = tried, new, float(new @ new)
        if np.abs(step).max() < _ENOUGH:
            break
    return span
