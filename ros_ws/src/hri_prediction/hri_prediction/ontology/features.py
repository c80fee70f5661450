"""Distances between two arms, by which interactions are told apart (thesis, 4.7.1).

Features 1 to 9 are the shortest distances of their segments (humerus, forearm, hand), 3 i + j + 1 for
segment i of agent 1 and j of agent 2; 10 to 25 those of their joints (shoulder, elbow, wrist, hand tip),
10 + 4 i + j.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError
from hri_prediction.geometry.segments import segment_distance

FloatArray = NDArray[np.float64]

SEGMENTS = ("humerus", "forearm", "hand")
JOINTS = ("shoulder", "elbow", "wrist", "hand tip")
FEATURES = tuple(
    f"{one}-{other}"
    for names in (SEGMENTS, JOINTS)
    for one, other in itertools.product(names, names)
)
"""Their names, what is agent 1's first."""
COUNT = len(FEATURES)


def _exchanged() -> NDArray[np.intp]:
    order = np.arange(COUNT)
    segments, joints = order[:9].reshape(3, 3), order[9:].reshape(4, 4)
    return np.concatenate((segments.T.ravel(), joints.T.ravel()))


EXCHANGED = _exchanged()
"""``features[..., EXCHANGED]`` are those of the same two arms with the agents exchanged."""


@njit
def fill_features(first: FloatArray, second: FloatArray, out: FloatArray) -> None:
    """The features of two arms at one time: keypoints (4, 3) and (4, 3) [m] to (25,) [m]."""
    for i in range(3):
        for j in range(3):
            out[3 * i + j] = segment_distance(first[i], first[i + 1], second[j], second[j + 1])
    for i in range(4):
        for j in range(4):
            squared = 0.0
            for k in range(3):
                squared += (first[i, k] - second[j, k]) ** 2
            out[9 + 4 * i + j] = math.sqrt(squared)


@njit
def _fill_all(first: FloatArray, second: FloatArray, out: FloatArray) -> None:
    for row in range(first.shape[0]):
        fill_features(first[row], second[row], out[row])


def pair_features(first: FloatArray, second: FloatArray) -> FloatArray:
    """The features of two arms over time.

    Args:
        first: Keypoints of agent 1 (n, 4, 3) [m].
        second: Of agent 2 (n, 4, 3) [m], same frame and times.

    Returns:
        (n, 25) [m]; NaN where an end is NaN.

    Raises:
        DataError: when the shapes do not fit.
    """
    one, other = np.ascontiguousarray(first, dtype=float), np.ascontiguousarray(second, dtype=float)
    for name, points in (("first", one), ("second", other)):
        if points.ndim != 3 or points.shape[1:] != (4, 3) or len(points) != len(one):
            raise DataError(
                f"keypoints {name} have shape {points.shape}", expected=f"({len(one)}, 4, 3)"
            )
    out = np.empty((len(one), COUNT))
    _fill_all(one, other, out)
    return out
