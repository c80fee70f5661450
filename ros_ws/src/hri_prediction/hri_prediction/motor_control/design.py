"""The reaches that the thesis had made: start postures, targets, durations (tables 2.2 and 2.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _frozen(rows: tuple[tuple[float, ...], ...]) -> Array:
    array = np.array(rows)
    array.setflags(write=False)
    return array


STARTS_DEG = _frozen(
    (
        (11.0, 6.6, 12.7), (11.2, 8.8, 33.4), (11.9, 31.9, 13.2),
        (-22.3, 12.5, 14.1), (-23.5, 15.8, 37.9), (-22.9, 37.3, 16.1),
        (42.2, 7.0, 12.3), (40.2, 7.1, 35.4), (35.4, 36.1, 10.1),
    )
)  # fmt: skip
"""Start postures P1 to P9 of chapter 2, (9, 3): mean q of its 15 people (table 2.2)."""
STARTS_12_DEG = _frozen(
    (
        (11.0, 6.6, 12.7), (11.2, 8.8, 33.4), (11.9, 31.9, 13.2), (13.0, 34.5, 37.9),
        (-22.3, 12.5, 14.1), (-23.5, 15.8, 37.9), (-22.9, 37.3, 16.1), (-23.6, 41.1, 35.8),
        (42.2, 7.0, 12.3), (40.2, 7.1, 35.4), (35.4, 36.1, 10.1), (35.1, 36.9, 43.4),
    )
)  # fmt: skip
"""Start postures P1 to P12 of chapter 3, (12, 3) (table 3.2): those of chapter 2, and three more."""
IN_CHAPTER_2 = (0, 1, 2, 4, 5, 6, 8, 9, 10)
"""Which of the twelve are P1 to P9 of chapter 2."""
LEVELS_12 = (
    ("middle", "low", "low"), ("middle", "low", "high"),
    ("middle", "high", "low"), ("middle", "high", "high"),
    ("up", "low", "low"), ("up", "low", "high"), ("up", "high", "low"), ("up", "high", "high"),
    ("down", "low", "low"), ("down", "low", "high"), ("down", "high", "low"), ("down", "high", "high"),
)  # fmt: skip
"""Of q1, q2 and q3 of each of the twelve: factors of chapter 3's analysis of variance."""
TARGETS_DEG = _frozen(
    (
        (-10.3, 82.0, 23.7), (7.2, 80.5, 29.4), (27.5, 83.5, 24.5),
        (-10.2, 66.6, 19.0), (6.7, 64.3, 24.0), (26.6, 66.5, 20.4),
        (-9.1, 55.0, 14.4), (5.2, 53.9, 14.9), (23.6, 54.5, 13.0),
    )
)  # fmt: skip
"""End postures at targets T1 to T9, (9, 3) (table 2.2)."""
DURATIONS_S = _frozen(((1.73, 1.63, 1.70, 1.57, 1.49, 1.57, 1.52, 1.44, 1.47),))[0]
"""Mean durations of reaches to T1 to T9 from P1 (9,) (table 2.4)."""


def tasks(starts_deg: Array = STARTS_DEG) -> list[tuple[int, int, Array, Array, float]]:
    """All reaches from start postures to targets.

    Returns:
        Of each: index of the start, of the target, q at both ends [rad], duration [s].
    """
    return [
        (
            start,
            target,
            np.radians(starts_deg[start]),
            np.radians(TARGETS_DEG[target]),
            float(DURATIONS_S[target]),
        )
        for start in range(len(starts_deg))
        for target in range(len(TARGETS_DEG))
    ]
