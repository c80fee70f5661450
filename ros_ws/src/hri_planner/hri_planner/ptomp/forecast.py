"""Where a person's arm is expected over the coming time, as the planner takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.layout import (
    LIMB_AXIS,
    LIMB_INVERSE,
    LIMB_RISE,
    LIMB_ROWS,
    LIMB_SIGMA,
    LIMB_SQUARE,
    LIMB_START,
    ROW,
)
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class HumanForecast:
    """Forecast of one arm (or several, stacked) on a uniform grid of the plan clock.

    Attributes:
        time0_s: Time of the first entry [s].
        dt_s: Grid spacing [s].
        mean: Shoulder, elbow, wrist and hand tip (K, 4, 3) or (arms, K, 4, 3) [m], base frame.
        sigma: Square root of the largest eigenvalue of each covariance (K, 4) or (arms, K, 4) [m].
        radii: Of upper arm, forearm and hand (3,) [m].
    """

    time0_s: float
    dt_s: float
    mean: FloatArray
    sigma: FloatArray
    radii: FloatArray

    def __post_init__(self) -> None:
        """Check shapes and values."""
        mean, sigma = np.asarray(self.mean, dtype=float), np.asarray(self.sigma, dtype=float)
        if mean.ndim not in (3, 4) or mean.shape[-2:] != (4, 3) or mean.shape[-3] < 1:
            raise DataError(f"forecast mean of shape {mean.shape}", expected="([arms,] K, 4, 3)")
        if sigma.shape != mean.shape[:-1] or np.shape(self.radii) != (3,):
            raise DataError(
                f"forecast sigma of shape {sigma.shape} and radii {np.shape(self.radii)}",
                expected=f"{mean.shape[:-1]} and (3,)",
            )
        if not (np.all(np.isfinite(mean)) and np.all(np.isfinite(sigma)) and self.dt_s > 0.0):
            raise DataError(
                "forecast holds NaN or infinity, or its step is not positive",
                hint="leave out arms that are not tracked",
            )

    def sample(self, times_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean (arms, n, 4, 3) and sigma (arms, n, 4) at times (n,) of the plan clock.

        Linear between entries; before the first and after the last entry the arm holds still.
        """
        mean = np.asarray(self.mean, dtype=float).reshape(-1, *np.shape(self.mean)[-3:])
        sigma = np.asarray(self.sigma, dtype=float).reshape(-1, *np.shape(self.sigma)[-2:])
        last = mean.shape[1] - 1
        place = np.clip((np.asarray(times_s) - self.time0_s) / self.dt_s, 0.0, last)
        below = np.minimum(place.astype(np.int64), max(last - 1, 0))
        above = np.minimum(below + 1, last)
        part = place - below
        points = mean[:, below] + part[:, None, None] * (mean[:, above] - mean[:, below])
        spread = sigma[:, below] + part[:, None] * (sigma[:, above] - sigma[:, below])
        return points, spread


def pack_forecasts(
    forecasts: Sequence[HumanForecast], times_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """All arms at the columns of a trajectory, in the layout of the kernels.

    Args:
        forecasts: Any number of forecasts.
        times_s: Times of the columns (P,) [s].

    Returns:
        Capsules (3 arms, LIMB_ROWS * ROW), see the layout, and their radii (3 arms,) [m].
    """
    sampled = [forecast.sample(times_s) for forecast in forecasts]
    arms = sum(len(points) for points, _ in sampled)
    capsules = np.zeros((arms, 3, LIMB_ROWS, ROW))
    radii = np.zeros((arms, 3))
    arm = 0
    for forecast, (points, spread) in zip(forecasts, sampled, strict=True):
        count = len(points)
        here = capsules[arm : arm + count, :, :, : len(times_s)]
        start = points[:, :, :3].transpose(0, 2, 3, 1)
        axis = points[:, :, 1:].transpose(0, 2, 3, 1) - start
        square = (axis**2).sum(axis=2)
        here[:, :, LIMB_START : LIMB_START + 3] = start
        here[:, :, LIMB_AXIS : LIMB_AXIS + 3] = axis
        here[:, :, LIMB_SQUARE] = square
        here[:, :, LIMB_INVERSE] = 1.0 / np.maximum(square, 1e-12)
        here[:, :, LIMB_SIGMA] = spread[:, :, :3].transpose(0, 2, 1)
        here[:, :, LIMB_RISE] = (spread[:, :, 1:] - spread[:, :, :3]).transpose(0, 2, 1)
        radii[arm : arm + count] = forecast.radii
        arm += count
    return capsules.reshape(3 * arms, LIMB_ROWS * ROW), radii.reshape(-1)
