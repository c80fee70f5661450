"""How like people a policy moves, by dynamic time warping (table 5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.geometry.warping import warped_distance

FloatArray = NDArray[np.float64]


def distances(made: Sequence[FloatArray], human: Sequence[FloatArray]) -> FloatArray:
    """Of each made path to each human one (len(made), len(human))."""
    return np.array([[warped_distance(one, other) for other in human] for one in made])


@dataclass(frozen=True)
class Likeness:
    """How made paths compare with human ones.

    Attributes:
        sample: Mean distance of a made path to the human one next to it (the thesis' measure, which
            rewards paths that are all alike).
        sample_sd: Its standard deviation.
        paired: Mean distance to the human path in the same situation.
        coverage: Share of the human paths that are the nearest of some made one.
    """

    sample: float
    sample_sd: float
    paired: float
    coverage: float


def likeness(made: Sequence[FloatArray], human: Sequence[FloatArray]) -> Likeness:
    """Compare paths; the i-th of both belong to the same situation."""
    found = distances(made, human)
    nearest = found.min(axis=1)
    return Likeness(
        sample=float(nearest.mean()),
        sample_sd=float(nearest.std()),
        paired=float(np.diagonal(found).mean()),
        coverage=len(np.unique(found.argmin(axis=1))) / len(human),
    )
