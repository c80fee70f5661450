"""The acceleration next to a wanted one within bounds, each a half-space, and a largest length.

Hildreth's method (1957) meets half-spaces; the largest length is met by its multiplier. All compiled.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_prediction.compiled import njit

_SWEEPS = 200
_HALVINGS = 24
_SETTLED = 1e-9
"""Changes of the acceleration that are none [m/s²]."""
_MISSED = 1e-4
"""A bound that is missed by more is missed [m/s²]."""


@njit
def nearest_allowed(wanted: Any, outward: Any, least: Any, most: float, people: int) -> Any:
    """The acceleration (3,) next to the wanted one with outward · a >= least, no longer than ``most``.

    Where there is none, the first ``people`` of the bounds are met, and the others as nearly as can be;
    where there is none even for them, none of these is missed by more than nearly as little as can be, and
    the others do not count: sweeps that settle too slowly between bounds that face each other take a
    little room that there is for none.
    """
    force = np.zeros(len(least))
    found = _projected(wanted, outward, least, force)
    if _length(found) <= most * (1.0 + 1e-12):  # as long as may be, but for rounding
        if _most_missed(found, outward, least) <= _MISSED:
            return found
    elif _has_room(outward, least, most):
        return _shortened(wanted, outward, least, most, force)
    if _has_room(outward[:people], least[:people], most):
        # The others are relaxed until there is room for them too.
        relaxed = least.copy()
        too_little, enough = 0.0, max(np.max(least), 0.0) + most
        for _ in range(_HALVINGS // 2):
            middle = 0.5 * (too_little + enough)
            relaxed[people:] = least[people:] - middle
            if _has_room(outward, relaxed, most):
                enough = middle
            else:
                too_little = middle
        relaxed[people:] = least[people:] - enough
        return _shortened(wanted, outward, relaxed, most, np.zeros(len(least)))
    outward, least = outward[:people], least[:people]
    # Relaxed until there is room: -most is met by all that is short enough.
    too_little, enough = 0.0, max(np.max(least), 0.0) + most
    for _ in range(_HALVINGS // 2):
        middle = 0.5 * (too_little + enough)
        if _has_room(outward, least - middle, most):
            enough = middle
        else:
            too_little = middle
    return _shortened(wanted, outward, least - enough, most, np.zeros(people))


@njit
def _shortened(wanted: Any, outward: Any, least: Any, most: float, force: Any) -> Any:
    """The same for bounds that leave room, by the multiplier of the length.

    What is next to the wanted among the allowed that are no longer than ``most`` is what is next to
    some share of the wanted, and the longer the larger that share (Karush, Kuhn, Tucker).
    """
    found = _projected(wanted, outward, least, force)
    if _length(found) <= most * (1.0 + 1e-12):  # as long as may be, but for rounding
        return found
    short, long = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (short + long)
        if _length(_projected(middle * wanted, outward, least, force)) <= most:
            short = middle
        else:
            long = middle
    found = _projected(short * wanted, outward, least, force)
    return found * min(most / max(_length(found), 1e-12), 1.0)


@njit
def _has_room(outward: Any, least: Any, most: float) -> bool:
    """Whether an acceleration that is no longer than ``most`` meets all bounds."""
    shortest = _projected(np.zeros(3), outward, least, np.zeros(len(least)))
    return _length(shortest) <= most * (1.0 + 1e-9) and (
        _most_missed(shortest, outward, least) <= _MISSED
    )


@njit
def _projected(wanted: Any, outward: Any, least: Any, force: Any) -> Any:
    """Hildreth's method: what is next to the wanted (3,) with outward · a >= least.

    By how much each bound pushes, ``force``, is that of a problem like this one before, and of this one
    after.
    """
    found = wanted.copy()
    for index in range(len(least)):
        for k in range(3):
            found[k] += force[index] * outward[index, k]
    for _ in range(_SWEEPS):
        moved = 0.0
        for index in range(len(least)):
            if least[index] == -np.inf:
                continue
            missing = least[index]
            for k in range(3):
                missing -= outward[index, k] * found[k]
            push = max(missing, -force[index])
            force[index] += push
            for k in range(3):
                found[k] += push * outward[index, k]
            moved = max(moved, abs(push))
        if moved < _SETTLED:
            break
    return found


@njit
def _most_missed(found: Any, outward: Any, least: Any) -> float:
    """By how much a bound is missed; negative: none is."""
    miss = -np.inf
    for index in range(len(least)):
        missing = least[index]
        for k in range(3):
            missing -= outward[index, k] * found[k]
        miss = max(miss, missing)
    return miss


@njit
def _length(vector: Any) -> float:
    return math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
