"""Whether a wrist is another one now, or elsewhere: markers were exchanged, or mistaken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.config import WatchConfig

FloatArray = NDArray[np.float64]

JUMP_M = 0.05
"""So far off where it was going may a wrist be whatever it does: noise, and a speed that is known badly
[m]."""
SPEED_S = 0.05
"""Over so long its speed is taken [s]."""
_LEAST_GAP_S = 0.004

Wrists = Sequence[tuple[float, FloatArray]]
"""Where a wrist was seen in the last :data:`SPEED_S`: times [s], places (3,) [m]."""


def jumped(
    own: Wrists,
    partner: Wrists,
    time_s: float,
    wrist: FloatArray,
    config: WatchConfig,
    longest_gap: float,
) -> float:
    """How far a wrist has jumped from where it was.

    Markers are most often exchanged when they were lost for a moment. Then no speed is too high, but the
    wrist is not where it was going.

    Args:
        own: Where it was.
        partner: Where the other one's was.
        time_s: When it is seen [s].
        wrist: Where (3,) [m].
        config: What speed and acceleration people can have.
        longest_gap: Of a wrist that was not seen for longer nobody knows where it was going [s].

    Returns:
        The way [m]; 0: it has not.
    """
    if not own:
        return 0.0
    last_s, last = own[-1]
    gap = time_s - last_s
    way = float(np.linalg.norm(wrist - last))
    if way > config.plausible_speed * max(gap, _LEAST_GAP_S):
        return way
    off = float(np.linalg.norm(wrist - _going_to(own, time_s)))
    # Also the speed is that of the middle of its window.
    span = gap * (0.5 * gap + 0.5 * SPEED_S)
    if off > JUMP_M + config.plausible_acceleration * span:
        return way
    # Nearer to where the other one's was going: the two were exchanged. The movement of one that was not
    # seen for long is lost anyway.
    if partner and off > JUMP_M and gap <= longest_gap:
        theirs = float(np.linalg.norm(wrist - _going_to(partner, time_s)))
        return way if theirs < 0.5 * off else 0.0
    return 0.0


def _going_to(wrists: Wrists, time_s: float) -> FloatArray:
    """Where a wrist is at a time when it goes on as it was seen to (3,) [m]."""
    (first_s, first), (last_s, last) = wrists[0], wrists[-1]
    if last_s - first_s < 0.4 * SPEED_S:
        return last
    found: FloatArray = last + (time_s - last_s) / (last_s - first_s) * (last - first)
    return found
