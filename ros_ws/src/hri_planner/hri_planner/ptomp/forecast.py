"""Where a person's arm is expected over the coming time, as the planner takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.layout import (
    ARM_AXIS,
    ARM_LENGTH,
    ARM_RISE,
    ARM_ROWS,
    ARM_SIGMA,
    ARM_START,
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


def forecast_of(
    time0_s: float, times_s: FloatArray, mean: FloatArray, covariance: FloatArray, radii: FloatArray
) -> HumanForecast:
    """Forecast of a predicted distribution of one arm.

    Args:
        time0_s: Plan clock at the first predicted point [s].
        times_s: Evenly spaced offsets of the points (K,), K >= 2 [s].
        mean: Keypoints (K, 4, 3) [m], base frame.
        covariance: Of each (K, 4, 3, 3) [m^2].
        radii: Of upper arm, forearm and hand (3,) [m].
    """
    largest = np.linalg.eigvalsh(covariance)[..., -1]
    step_s = float((times_s[-1] - times_s[0]) / (len(times_s) - 1))
    return HumanForecast(time0_s, step_s, mean, np.sqrt(largest.clip(min=0.0)), radii)


def pack_forecasts(
    forecasts: Sequence[HumanForecast], times_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """All arms at the columns of a trajectory, in the layout of the kernels.

    Args:
        forecasts: Any number of forecasts.
        times_s: Times of the columns (P,) [s].

    Returns:
        Arms (arms, ARM_ROWS * ROW), see the layout, and the radii of their limbs (arms, 3) [m].
    """
    sampled = [forecast.sample(times_s) for forecast in forecasts]
    arms = sum(len(points) for points, _ in sampled)
    rows = np.zeros((arms, ARM_ROWS, ROW))
    radii = np.zeros((arms, 3))
    arm = 0
    for forecast, (points, spread) in zip(forecasts, sampled, strict=True):
        count, columns = points.shape[:2]
        here = rows[arm : arm + count, :, :columns]
        axis = points[:, :, 1:] - points[:, :, :3]
        length = np.sqrt((axis**2).sum(axis=3))
        inverse = 1.0 / np.maximum(length, 1e-6)
        unit = axis * inverse[..., None]
        rise = (spread[:, :, 1:] - spread[:, :, :3]) * inverse
        for first, values in (
            (ARM_START, points[:, :, :3].reshape(count, columns, 9)),
            (ARM_AXIS, unit.reshape(count, columns, 9)),
            (ARM_LENGTH, length),
            (ARM_SIGMA, spread[:, :, :3]),
            (ARM_RISE, rise),
        ):
            here[:, first : first + values.shape[2]] = values.transpose(0, 2, 1)
        radii[arm : arm + count] = forecast.radii
        arm += count
    return rows.reshape(arms, ARM_ROWS * ROW), radii
