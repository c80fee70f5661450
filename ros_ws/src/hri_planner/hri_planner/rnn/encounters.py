"""Two hands that were recorded while one of them reached: what policies are taught by and judged by."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.rnn.model import STEP_S
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

TURNS_DEG = (0.0, 90.0, 180.0, 270.0)
"""About the vertical; with them nothing is learnt of the direction that recordings happened to have."""

CUTOFF_HZ = 6.0
"""Of the low-pass: reaches have next to nothing above, differentiated tracking noise has."""


@dataclass(frozen=True, eq=False)
class Encounter:
    """One reach of a hand beside a partner's, evenly sampled.

    Attributes:
        hand: Learner's hand (n, 3), n >= 2 [m], z up.
        partner: Partner's hand (n, 3) [m], same frame; held where its record ended.
        goal: Where the learner's hand ends (3,) [m].
        setup: Name of the places that people reached between.
        backward: Whether the reach leads back to the learner's home.
        pair: Name of the two people.

    Raises:
        DataError: on wrong shapes or values that are not finite.
    """

    hand: FloatArray
    partner: FloatArray
    goal: FloatArray
    setup: str = ""
    backward: bool = False
    pair: str = ""

    def __post_init__(self) -> None:
        """Check the values, copy and freeze the arrays."""
        hand, partner = np.array(self.hand, dtype=float), np.array(self.partner, dtype=float)
        goal = np.array(self.goal, dtype=float)
        if hand.ndim != 2 or hand.shape[1:] != (3,) or len(hand) < 2 or goal.shape != (3,):
            raise DataError(
                f"hand {hand.shape}, goal {goal.shape}", expected="(n, 3) with n >= 2, and (3,)"
            )
        if partner.shape != hand.shape:
            raise DataError(f"partner's hand {partner.shape}", expected=f"{hand.shape}")
        for name, values in (("hand", hand), ("partner", partner), ("goal", goal)):
            if not np.isfinite(values).all():
                raise DataError(f"{name} of an encounter is not finite", expected="metres")
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.hand)

    def turned(self, degrees: float) -> Encounter:
        """The same, turned about the vertical."""
        angle = math.radians(degrees)
        cosine, sine = round(math.cos(angle), 15), round(math.sin(angle), 15)
        turn = np.array(((cosine, -sine, 0.0), (sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        return replace(
            self, hand=self.hand @ turn.T, partner=self.partner @ turn.T, goal=turn @ self.goal
        )


def in_all_directions(encounters: Sequence[Encounter]) -> list[Encounter]:
    """Each of them turned by each of :data:`TURNS_DEG`."""
    return [one.turned(angle) for angle in TURNS_DEG for one in encounters]


def smoothed(positions: ArrayLike, rate_hz: float, dt: float = STEP_S) -> FloatArray:
    """A recorded path without tracking noise, at the time step of policies.

    Low-passed forwards and backwards, so that nothing is late (second order, 6 Hz), then taken at
    multiples of ``dt`` between samples by cubic interpolation.

    Args:
        positions: Shape (n, 3) [m], evenly sampled, without gaps.
        rate_hz: Of the samples.
        dt: Time step of the result [s].

    Raises:
        DataError: when there are too few samples, or one is not finite.
    """
    # Half a second of the start of whatever imports this, and most of it smooths nothing.
    from scipy.interpolate import CubicSpline
    from scipy.signal import butter, sosfiltfilt

    path = np.asarray(positions, dtype=float)
    if path.ndim != 2 or path.shape[1:] != (3,) or len(path) < 8:
        raise DataError(f"positions have shape {path.shape}", expected="(n, 3) with n >= 8")
    if not np.isfinite(path).all():
        raise DataError("a recorded position is not finite", hint="fill gaps first")
    if rate_hz > 2.5 * CUTOFF_HZ:
        sections = butter(2, CUTOFF_HZ, fs=rate_hz, output="sos")
        pad = min(len(path) - 1, round(rate_hz / CUTOFF_HZ) * 3)
        path = sosfiltfilt(sections, path, axis=0, padlen=pad)
    count = math.floor((len(path) - 1) / rate_hz / dt + 1e-6) + 1
    times = np.arange(len(path)) / rate_hz
    found: FloatArray = CubicSpline(times, path)(np.arange(count) * dt)
    return found
