"""Shortest distance between two segments, hence between two capsules.

After C. Ericson, Real-Time Collision Detection (2005), section 5.1.9, with one more projection step
that keeps nearly parallel segments accurate.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@njit
def _clamp(value: float) -> float:
    return min(max(value, 0.0), 1.0)


@njit
def closest_parameters(
    a0: FloatArray, a1: FloatArray, b0: FloatArray, b1: FloatArray
) -> tuple[float, float, float]:
    """Closest points of segments a0-a1 and b0-b1 (each end point (3,), [m], one frame).

    Returns:
        (s, t, squared distance): the points are a0 + s (a1 - a0) and b0 + t (b1 - b0), with s and t
        in [0, 1]. Segments of zero length are points. Where many pairs are closest (parallel
        segments), any one of them.
    """
    best_s, best_t, best = 0.0, 0.0, math.inf
    aa, bb, ab, ar, br = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, v, r = a1[i] - a0[i], b1[i] - b0[i], a0[i] - b0[i]
        aa += u * u
        bb += v * v
        ab += u * v
        ar += u * r
        br += v * r
    determinant = aa * bb - ab * ab
    # Candidate starts: the lines' common perpendicular and both ends of a. Each is polished by
    # alternating projection, exact for the ends and a mend for the cancellation in the determinant.
    for start in range(3):
        if start == 0:
            s = _clamp((ab * br - ar * bb) / determinant) if determinant > 0.0 else 0.5
        else:
            s = start - 1.0
        t = _clamp((ab * s + br) / bb) if bb > 0.0 else 0.0
        s = _clamp((ab * t - ar) / aa) if aa > 0.0 else 0.0
        t = _clamp((ab * s + br) / bb) if bb > 0.0 else 0.0
        squared = 0.0
        for i in range(3):
            gap = a0[i] - b0[i] + s * (a1[i] - a0[i]) - t * (b1[i] - b0[i])
            squared += gap * gap
        if not squared >= best:  # so that NaN passes on instead of reading as far away
            best_s, best_t, best = s, t, squared
    return best_s, best_t, best


@njit
def segment_distance(a0: FloatArray, a1: FloatArray, b0: FloatArray, b1: FloatArray) -> float:
    """Shortest distance of two segments [m]; arguments as :func:`closest_parameters`."""
    return math.sqrt(closest_parameters(a0, a1, b0, b1)[2])


@njit
def _fill_distances(
    a: FloatArray, ra: FloatArray, b: FloatArray, rb: FloatArray, out: FloatArray
) -> None:
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            axis = segment_distance(a[i, 0], a[i, 1], b[j, 0], b[j, 1])
            out[i, j] = axis - ra[i] - rb[j]


def capsule_distances(a: FloatArray, ra: FloatArray, b: FloatArray, rb: FloatArray) -> FloatArray:
    """Signed surface distances of all pairs of two sets of capsules.

    Args:
        a: Axes (n, 2, 3) [m].
        ra: Radii (n,) [m].
        b: Axes (m, 2, 3) [m], same frame.
        rb: Radii (m,) [m].

    Returns:
        (n, m) [m]: distance of the axes less both radii; negative where the capsules overlap, NaN
        where an axis is NaN.

    Raises:
        DataError: when the shapes do not fit.
    """
    first, second = np.ascontiguousarray(a, dtype=float), np.ascontiguousarray(b, dtype=float)
    radii_a, radii_b = np.asarray(ra, dtype=float), np.asarray(rb, dtype=float)
    for name, axes, radii in (("a", first, radii_a), ("b", second, radii_b)):
        if axes.ndim != 3 or axes.shape[1:] != (2, 3) or radii.shape != axes.shape[:1]:
            raise DataError(
                f"capsules {name} have axes {axes.shape} and radii {radii.shape}",
                expected="axes (n, 2, 3) and radii (n,)",
            )
    out = np.empty((len(first), len(second)))
    _fill_distances(first, radii_a, second, radii_b, out)
    return out
