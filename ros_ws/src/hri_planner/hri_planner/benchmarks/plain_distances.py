"""Capsule distances in NumPy, all configurations at once: what the kernel is measured against.

Two ways to write forward kinematics and capsule distances. :func:`arm_points` and :func:`capsule_gaps` are
how one would write them: rotation matrices, and points as the last axis of an array. :func:`row_gaps` is
how NumPy is fastest at it: every coordinate an array of its own, closed formulas, no small axis. The latter
takes its functions from a module, so it is PyTorch's version too.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PARALLEL = 1e-14  # m^4, keeps the division of parallel axes finite


def arm_points(q: Array, lengths: Array) -> Array:
    """Shoulder, elbow, wrist, tool (..., 4, 3) by rotation matrices, configurations (..., 7)."""

    def about_z(angle: Array) -> Array:
        c, s, o, e = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
        return np.stack([c, -s, o, s, c, o, o, o, e], -1).reshape(*angle.shape, 3, 3)

    def about_y(angle: Array) -> Array:
        c, s, o, e = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
        return np.stack([c, o, s, o, e, o, -s, o, c], -1).reshape(*angle.shape, 3, 3)

    turn = about_z(q[..., 0]) @ about_y(-q[..., 1])
    shoulder = np.broadcast_to([0.0, 0.0, lengths[0]], (*q.shape[:-1], 3))
    elbow = shoulder + lengths[1] * turn[..., 2]
    turn = turn @ about_z(q[..., 2]) @ about_y(q[..., 3])
    wrist = elbow + lengths[2] * turn[..., 2]
    turn = turn @ about_z(q[..., 4]) @ about_y(-q[..., 5])
    tool = wrist + lengths[3] * turn[..., 2]
    return np.stack([shoulder, elbow, wrist, tool], axis=-2)


def capsule_gaps(
    points: Array, radii: Array, arm: Array, human_radii: Array
) -> tuple[Array, Array]:
    """Distances of surfaces and places on the human limb (..., 3, 3) by clamped projection.

    Args:
        points: Of the robot (..., 4, 3) [m].
        radii: Of its capsules (3,) [m].
        arm: Points of a person's arm (..., 4, 3) [m].
        human_radii: Of its capsules (3,) [m].
    """
    u, v = np.diff(points, axis=-2), np.diff(arm, axis=-2)
    r = points[..., :-1, None, :] - arm[..., None, :-1, :]
    a, e = _dot(u, u)[..., :, None], _dot(v, v)[..., None, :]
    b = u @ np.swapaxes(v, -1, -2)
    c, f = _dot(u[..., :, None, :], r), _dot(v[..., None, :, :], r)
    s = np.clip((b * f - c * e) / (a * e - b * b + _PARALLEL), 0.0, 1.0)
    t = np.clip((b * s + f) / e, 0.0, 1.0)
    s = np.clip((b * t - c) / a, 0.0, 1.0)
    r += s[..., None] * u[..., :, None, :]
    r -= t[..., None] * v[..., None, :, :]
    return np.sqrt(_dot(r, r)) - (radii[:, None] + human_radii), t


def _dot(x: Array, y: Array) -> Array:
    product: Array = np.einsum("...i,...i->...", x, y)
    return product


def row_points(q: Sequence[Any], lengths: Sequence[float], xp: Any) -> list[list[Any]]:
    """Shoulder, elbow, wrist and tool as three arrays each.

    Args:
        q: Six joints' angles [rad], arrays of one shape.
        lengths: The arm's (4,) [m].
        xp: ``numpy`` or ``torch``.
    """
    s, c = [xp.sin(angle) for angle in q], [xp.cos(angle) for angle in q]
    zero = xp.zeros_like(q[0])
    base, upper, lower, hand = lengths
    z = [-c[0] * s[1], -s[0] * s[1], c[1]]
    elbow = [upper * z[0], upper * z[1], base + upper * z[2]]
    m = [c[0] * c[1], s[0] * c[1]]
    u = [c[2] * m[0] - s[2] * s[0], c[2] * m[1] + s[2] * c[0], c[2] * s[1]]
    y = [-c[2] * s[0] - s[2] * m[0], c[2] * c[0] - s[2] * m[1], -s[2] * s[1]]
    x = [c[3] * first - s[3] * second for first, second in zip(u, z, strict=True)]
    z = [s[3] * first + c[3] * second for first, second in zip(u, z, strict=True)]
    wrist = [end + lower * axis for end, axis in zip(elbow, z, strict=True)]
    u = [c[4] * first + s[4] * second for first, second in zip(x, y, strict=True)]
    tool = [
        end + hand * (c[5] * along - s[5] * aside)
        for end, along, aside in zip(wrist, z, u, strict=True)
    ]
    return [[zero, zero, zero + base], elbow, wrist, tool]


def row_gaps(
    robot: Sequence[Sequence[Any]],
    radii: Sequence[float],
    arm: Sequence[Sequence[Any]],
    human_radii: Sequence[float],
    xp: Any,
) -> list[list[tuple[Any, Any]]]:
    """As :func:`capsule_gaps`, points as three arrays each; by robot's part and limb."""

    def dot(x: Sequence[Any], y: Sequence[Any]) -> Any:
        return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]

    def between(points: Sequence[Sequence[Any]]) -> list[list[Any]]:
        return [[b - a for a, b in zip(*pair, strict=True)] for pair in itertools.pairwise(points)]

    axes, limbs = between(robot), between(arm)
    squares = [dot(axis, axis) for axis in limbs]
    found: list[list[tuple[Any, Any]]] = []
    for part, u in enumerate(axes):
        a = dot(u, u)
        found.append([])
        for limb, v in enumerate(limbs):
            r = [p - h for p, h in zip(robot[part], arm[limb], strict=True)]
            b, c, e, f = dot(u, v), dot(u, r), squares[limb], dot(v, r)
            s = xp.clip((b * f - c * e) / (a * e - b * b + _PARALLEL), 0.0, 1.0)
            t = xp.clip((b * s + f) / e, 0.0, 1.0)
            s = xp.clip((b * t - c) / a, 0.0, 1.0)
            g = [r[axis] + s * u[axis] - t * v[axis] for axis in range(3)]
            found[-1].append((xp.sqrt(dot(g, g)) - (radii[part] + human_radii[limb]), t))
    return found
