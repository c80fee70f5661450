"""Clamped quintic B-splines over the phase of a reach, and the points at which costs are summed up."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]

DEGREE = 5
SUPPORT = DEGREE + 1
"""Coefficients that have a part in any one point."""
DERIVATIVES = 4
"""Position, velocity, acceleration, jerk."""


@dataclass(frozen=True)
class SplineTable:
    """A spline on [0, 1] at the points of a Gauss quadrature.

    Attributes:
        intervals: K, all of the same length.
        points: Phases (N,), by interval.
        weights: Of the quadrature (N,); they sum to 1.
        values: Basis functions and their derivatives by the phase that are not zero at each point
            (N, 4, 6).
        first: Index of the coefficient that the first of these belongs to (N,).
        start: The same at phase 0 (4, 6), of the first six coefficients.
        end: The same at phase 1 (4, 6), of the last six.
        jerk_gram: Inner products of the third derivatives of all basis functions (K + 5, K + 5).
    """

    intervals: int
    points: Array
    weights: Array
    values: Array
    first: NDArray[np.int64]
    start: Array
    end: Array
    jerk_gram: Array

    @property
    def coefficients(self) -> int:
        """Their number for each joint, K + 5."""
        return self.intervals + DEGREE


@functools.cache
def spline_table(intervals: int = 16, points: int = 4) -> SplineTable:
    """The table of a spline with so many intervals and Gauss points in each."""
    nodes, node_weights = np.polynomial.legendre.leggauss(points)
    left = np.arange(intervals) / intervals
    phases = (left[:, None] + (0.5 * (nodes + 1.0) / intervals)[None]).ravel()
    weights = np.tile(0.5 * node_weights / intervals, intervals)
    first = np.repeat(np.arange(intervals), points)
    values = basis_at(phases, intervals)
    whole = np.zeros((len(phases), intervals + DEGREE))
    np.put_along_axis(whole, first[:, None] + np.arange(SUPPORT), values[:, 3], axis=1)
    table = SplineTable(
        intervals,
        phases,
        weights,
        values,
        first,
        basis_at(np.array([0.0]), intervals)[0],
        basis_at(np.array([1.0]), intervals)[0],
        whole.T @ (weights[:, None] * whole),
    )
    for array in (phases, weights, first, table.jerk_gram):
        array.setflags(write=False)
    return table


def knots(intervals: int) -> Array:
    """Clamped knots (K + 11,)."""
    return np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, intervals + 1), np.ones(DEGREE)])


def interval_of(phases: Array, intervals: int) -> NDArray[np.int64]:
    """Interval that each phase lies in; its number is that of the first coefficient that counts there."""
    return np.clip((phases * intervals).astype(np.int64), 0, intervals - 1)


def basis_at(phases: Array, intervals: int) -> Array:
    """Basis functions and derivatives that are not zero at phases (N,): (N, 4, 6), read-only.

    The same phases are asked for again and again, so the last few answers are kept.
    """
    return _basis_at(np.asarray(phases, dtype=float).tobytes(), intervals)


@functools.lru_cache(maxsize=32)
def _basis_at(content: bytes, intervals: int) -> Array:
    phases = np.frombuffer(content)
    rows = interval_of(phases, intervals)
    found = np.empty((len(phases), DERIVATIVES, SUPPORT))
    columns = rows[:, None] + np.arange(SUPPORT)
    identity = BSpline(knots(intervals), np.eye(intervals + DEGREE), DEGREE)
    for order in range(DERIVATIVES):
        whole = identity.derivative(order)(phases) if order else identity(phases)
        found[:, order] = np.take_along_axis(whole, columns, axis=1)
    found.setflags(write=False)
    return found
