"""One tracked arm: a single sample, and a recorded trial."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import KEYPOINTS, FloatArray, check_side
from hri_prediction.errors import DataError
from hri_prediction.tracks.placement import Placement


def _frozen(array: NDArray) -> NDArray:
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class ArmSample:
    """The arm at one capture.

    Attributes:
        stamp_ns: Capture time [ns] on the clock of the sensor, never the time of receipt.
        keypoints: Shoulder, elbow, wrist, hand tip in the world frame, shape (4, 3) [m]; NaN where
            not valid. Copied and read-only.
        valid: Which keypoints were seen, shape (4,) bool. Copied and read-only.
        side: ``"left"`` or ``"right"``.

    Raises:
        DataError: on wrong shapes or sides, and when a valid keypoint is not finite.
    """

    stamp_ns: int
    keypoints: FloatArray
    valid: NDArray[np.bool_]
    side: str

    def __post_init__(self) -> None:
        """Check the values, copy and freeze the arrays."""
        check_side(self.side)
        points = np.array(self.keypoints, dtype=np.float64)
        valid = np.array(self.valid, dtype=bool)
        if points.shape != (4, 3):
            raise DataError(f"keypoints have shape {points.shape}", expected="(4, 3)")
        if valid.shape != (4,):
            raise DataError(f"valid has shape {valid.shape}", expected="(4,)")
        # Nearly all samples are seen as a whole, and come a thousand times a second.
        whole = bool(valid.all())
        if not np.isfinite(points if whole else points[valid]).all():
            raise DataError(
                "a valid keypoint is not finite", expected="finite coordinates or valid = False"
            )
        if not whole:
            points[~valid] = np.nan
        object.__setattr__(self, "stamp_ns", int(self.stamp_ns))
        object.__setattr__(self, "keypoints", _frozen(points))
        object.__setattr__(self, "valid", _frozen(valid))


@dataclass(frozen=True, eq=False)
class ArmTrack:
    """One trial of one arm.

    Attributes:
        time_s: Capture times, shape (N,), N >= 2, strictly increasing [s]. Copied, read-only.
        keypoints: Shoulder, elbow, wrist, hand tip, shape (N, 4, 3) [m], in the frame of the source
            until :meth:`transformed` brings them to the world; NaN where not seen. A keypoint with
            any coordinate missing is wholly NaN. Copied, read-only.
        side: ``"left"`` or ``"right"``.
        subject: Name of the person.
        task: Name of the movement.
        trial: Number of the trial within subject, task and side.
        source: Where the trial came from (file name and what a reader needs to know).

    Raises:
        DataError: on wrong shapes, times that do not increase, infinite values, unknown sides.
    """

    time_s: FloatArray
    keypoints: FloatArray
    side: str = "right"
    subject: str = ""
    task: str = ""
    trial: int = 0
    source: str = ""

    def __post_init__(self) -> None:
        """Check the values, copy and freeze the arrays."""
        check_side(self.side)
        time = np.array(self.time_s, dtype=np.float64)
        points = np.array(self.keypoints, dtype=np.float64)
        if time.ndim != 1 or len(time) < 2:
            raise DataError(f"time_s has shape {time.shape}", expected="(N,) with at least 2 rows")
        if points.shape != (len(time), 4, 3):
            raise DataError(
                f"keypoints have shape {points.shape}",
                expected=f"({len(time)}, 4, 3): rows of time_s, " + ", ".join(KEYPOINTS),
            )
        if not np.isfinite(time).all():
            row = int(np.flatnonzero(~np.isfinite(time))[0])
            raise DataError(f"time_s[{row}] = {time[row]}", expected="finite times")
        steps = np.diff(time)
        if (steps <= 0.0).any():
            row = int(np.flatnonzero(steps <= 0.0)[0]) + 1
            raise DataError(
                f"time_s[{row}] = {time[row]:.6g} after {time[row - 1]:.6g}",
                expected="strictly increasing times",
            )
        if np.isinf(points).any():
            raise DataError("keypoints hold infinite values", expected="metres, or NaN if not seen")
        points[np.isnan(points).any(axis=-1)] = np.nan
        object.__setattr__(self, "time_s", _frozen(time))
        object.__setattr__(self, "keypoints", _frozen(points))
        object.__setattr__(self, "trial", int(self.trial))

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.time_s)

    @property
    def rate_hz(self) -> float:
        """Sampling rate [Hz]: one over the median step."""
        return float(1.0 / np.median(np.diff(self.time_s)))

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which keypoints were seen, shape (N, 4)."""
        seen: NDArray[np.bool_] = np.isfinite(self.keypoints[..., 0])
        return seen

    @property
    def duration(self) -> float:
        """Time from the first to the last row [s]."""
        return float(self.time_s[-1] - self.time_s[0])

    def slice(self, t0: float, t1: float) -> ArmTrack:
        """The rows with ``t0 <= time <= t1`` [s].

        Raises:
            DataError: when fewer than two rows remain.
        """
        keep = (self.time_s >= t0) & (self.time_s <= t1)
        if keep.sum() < 2:
            raise DataError(
                f"only {int(keep.sum())} rows lie within {t0:g} to {t1:g} s",
                expected=f"a part of {self.time_s[0]:g} to {self.time_s[-1]:g} s",
            )
        return dataclasses.replace(self, time_s=self.time_s[keep], keypoints=self.keypoints[keep])

    def transformed(self, placement: Placement) -> ArmTrack:
        """The same trial in the frame that ``placement`` maps to."""
        return dataclasses.replace(self, keypoints=placement.apply(self.keypoints))

    def resampled(self, rate_hz: float, max_gap_s: float = 0.1) -> ArmTrack:
        """The trial on a uniform grid that begins at the first row.

        Interpolates with monotone cubics (Fritsch and Carlson 1980: local, no overshoot).

        Args:
            rate_hz: New rate [Hz].
            max_gap_s: Longest time between two seen samples of a keypoint that is interpolated
                [s]; longer gaps stay NaN.

        Raises:
            DataError: when the rate is not positive or leaves fewer than two rows.
        """
        if not (math.isfinite(rate_hz) and rate_hz > 0.0):
            raise DataError(f"rate_hz = {rate_hz!r}", expected="a positive rate in Hz")
        # The tolerance keeps the last row when duration * rate is a whole number up to rounding.
        count = math.floor(self.duration * rate_hz + 1e-6) + 1
        if count < 2:
            raise DataError(
                f"{rate_hz:g} Hz leaves {count} row of {self.duration:g} s", expected="two rows"
            )
        time = np.minimum(self.time_s[0] + np.arange(count) / rate_hz, self.time_s[-1])
        points = self._interpolated(time, max_gap_s)
        return dataclasses.replace(self, time_s=time, keypoints=points)

    def filled(self, max_gap_s: float) -> ArmTrack:
        """The trial with short gaps filled by interpolation (see :meth:`resampled`).

        Args:
            max_gap_s: Longest time between the seen samples on both sides of a gap that is
                filled [s]. Gaps at the ends are never filled.
        """
        filled = self._interpolated(self.time_s, max_gap_s)
        points = np.where(self.valid[..., None], self.keypoints, filled)
        return dataclasses.replace(self, keypoints=points)

    def samples(self, start_ns: int = 0) -> Iterator[ArmSample]:
        """The rows as samples, the first one stamped ``start_ns``."""
        valid = self.valid
        for row, time in enumerate(self.time_s):
            stamp = start_ns + round(float(time - self.time_s[0]) * 1e9)
            yield ArmSample(stamp, self.keypoints[row], valid[row], self.side)

    def _interpolated(self, time: FloatArray, max_gap_s: float) -> FloatArray:
        """Keypoints at ``time`` (within the trial), NaN inside gaps longer than ``max_gap_s``."""
        # A sixth of the start of a node, and few nodes have a use for it.
        from scipy.interpolate import PchipInterpolator

        out = np.full((len(time), 4, 3), np.nan)
        valid = self.valid
        for keypoint in range(4):
            rows = np.flatnonzero(valid[:, keypoint])
            if len(rows) < 2:
                continue
            seen = self.time_s[rows]
            spline = PchipInterpolator(seen, self.keypoints[rows, keypoint], axis=0)
            right = np.clip(np.searchsorted(seen, time), 1, len(seen) - 1)
            step = seen[right] - seen[right - 1]
            inside = (time >= seen[0]) & (time <= seen[-1])
            # Rows that coincide with a seen sample count as seen, whatever the gap beside them.
            exact = np.isin(time, seen)
            keep = inside & ((step <= max_gap_s * (1.0 + 1e-9)) | exact)
            out[keep, keypoint] = spline(time[keep])
        return out
