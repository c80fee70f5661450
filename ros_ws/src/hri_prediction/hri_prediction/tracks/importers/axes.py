"""Which way the axes of a file point: what it says, what its format always has, what a body tells."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError
from hri_prediction.tracks.importers.mapping import seen
from hri_prediction.tracks.importers.marker_sets import BODY_HEIGHTS, expanded, plain
from hri_prediction.tracks.importers.markers import MarkerData, bare

_UP = {"x-up": "y,z,x", "y-up": "x,-z,y", "z-up": "x,y,z"}
_EXPECTED = "auto, x-up, y-up, z-up, or three different axes of the file such as x,-z,y"
_LEAST_SPREAD_M = 0.3
_LEAST_LEAD = 2.0


@dataclass(frozen=True)
class Axes:
    """Axes of the file behind x, y and z of the track.

    Attributes:
        text: As ``--axes`` takes it.
        why: Where it comes from, for people.
        guessed: It should be confirmed.
    """

    text: str
    why: str = "given"
    guessed: bool = False

    @property
    def matrix(self) -> FloatArray:
        """Coordinates of the file to those of the track, shape (3, 3)."""
        matrix = np.zeros((3, 3))
        for row, name in enumerate(self.text.split(",")):
            matrix[row, "xyz".index(name[-1])] = -1.0 if name[0] == "-" else 1.0
        return matrix

    @property
    def mirrored(self) -> bool:
        """The axes of the file are left-handed."""
        return bool(np.linalg.det(self.matrix) < 0.0)


def parse_axes(text: str) -> Axes:
    """Read ``x-up``, ``y-up``, ``z-up`` or three axes.

    Raises:
        ConfigError: when the text is none of these.
    """
    short = _UP.get(text.strip().lower(), text.strip().lower())
    names = [name.strip().removeprefix("+") for name in short.split(",")]
    if sorted(name.removeprefix("-") for name in names) != ["x", "y", "z"]:
        raise ConfigError(f"--axes {text}", expected=_EXPECTED)
    return Axes(",".join(names))


def find_axes(data: MarkerData) -> Axes:
    """The turn that brings the file's upward axis to z, and keeps right-handed axes so."""
    body = upward_axis(data)
    if data.up and (data.up_fixed or not body or body == data.up):
        doubt = bool(body) and body != data.up
        why = f"{data.format} has {data.up} up" if data.up_fixed else f"the file says {data.up} up"
        if doubt:
            why = f"head, trunk and legs have {body} up, against {data.format}'s {data.up}"
        return Axes(turn_up(body if doubt else data.up), why, guessed=doubt)
    if data.up:
        why = f"the file says {data.up} up; head, trunk and legs have {body} up"
        return Axes(turn_up(data.up), why, guessed=True)
    if body:
        return Axes(turn_up(body), f"head, trunk and legs have {body} up", guessed=True)
    usual = "+y" if data.format == "TRC" else "+z"
    return Axes(turn_up(usual), f"the file does not say; usual is {usual} up", guessed=True)


def turn_up(up: str) -> str:
    """Axes, as ``--axes`` takes them, that bring ``up`` (such as ``+y``) to z.

    Of the right-handed ones, those that keep most axes as they are.
    """
    if up == "+x":
        return _UP["x-up"]
    one, two = (name for name in "xyz" if name != up[1])
    texts = (
        f"{first}{one},{second}{two},{up.removeprefix('+')}"
        for first, second in itertools.product(("", "-"), repeat=2)
    )
    return next(text for text in texts if not Axes(text).mirrored)


def upward_axis(data: MarkerData) -> str:
    """The axis along which known markers of head, trunk and legs are stacked; empty if unclear."""
    heights = {
        name: height
        for height, patterns in BODY_HEIGHTS.items()
        for pattern in patterns
        for name in expanded(pattern)
    }
    present = seen(data)
    points, levels = [], []
    for row, label in enumerate(data.labels):
        height = heights.get(plain(bare(label)))
        if height is not None and present[:, row].any():
            points.append(np.median(data.positions[present[:, row], row], axis=0))
            levels.append(height)
    if not levels or max(levels) - min(levels) < _LEAST_SPREAD_M:
        return ""
    level = np.array(levels) - np.mean(levels)
    along = level @ (np.array(points) - np.mean(points, axis=0))
    order = np.argsort(-np.abs(along))
    if abs(along[order[0]]) < _LEAST_LEAD * abs(along[order[1]]):
        return ""
    return ("+" if along[order[0]] > 0.0 else "-") + "xyz"[order[0]]
