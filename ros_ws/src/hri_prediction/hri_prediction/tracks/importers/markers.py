"""What every reader of marker files returns: named points over time, as they stand in the file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError

MOST_FRAMES = 50_000_000
"""Longest span of frame numbers that is believed: two days at 250 Hz."""


@dataclass(frozen=True, eq=False)
class MarkerData:
    """Markers (or joints) of one recording, in the units and axes of the file.

    Attributes:
        format: Name of the format, for people.
        labels: Names, unique: repeated ones end in ``#1``, ``#2``, and so on.
        positions: Shape (N, M, 3), in the unit of the file; NaN where not seen.
        frames: Frame numbers, shape (N,), strictly increasing; a jump is a gap in time.
        rate_hz: Frames a second; 0 where the file does not say.
        unit: What the file says, such as ``mm``; empty where it says nothing.
        up: Axis that points up, such as ``+z``; empty where the file does not say.
        up_fixed: The format has one upward axis, whether or not the file says so.
        clock: The file's own times [s], shape (N,); None where it has none.
        zeros_missing: (0, 0, 0) is how such files write a marker that was not seen.
        source: Name of the file.
        notes: What is odd about the file, for people.

    Raises:
        DataError: no marker, fewer than two rows, frames that do not increase, or a span of them that
            no recording has.
    """

    format: str
    labels: tuple[str, ...]
    positions: FloatArray
    frames: FloatArray
    rate_hz: float
    unit: str = ""
    up: str = ""
    up_fixed: bool = False
    clock: FloatArray | None = None
    zeros_missing: bool = True
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the values."""
        if not self.labels:
            raise DataError(f"the {self.format} file holds no points", expected="markers")
        if len(self.frames) < 2:
            raise DataError(
                f"the {self.format} file holds {len(self.frames)} frames of markers",
                expected="at least two",
            )
        if not np.isfinite(self.frames).all():
            row = int(np.flatnonzero(~np.isfinite(self.frames))[0])
            raise DataError(f"row {row + 1} has no frame number", expected="a whole number")
        steps = np.diff(self.frames)
        if (steps <= 0.0).any():
            row = int(np.flatnonzero(steps <= 0.0)[0])
            raise DataError(
                f"frame {self.frames[row + 1]:g} follows frame {self.frames[row]:g}",
                expected="strictly increasing frame numbers",
            )
        span = float(self.frames[-1] - self.frames[0])
        if span > MOST_FRAMES:
            row = int(np.argmax(steps))
            raise DataError(
                f"frame {self.frames[row + 1]:.0f} follows frame {self.frames[row]:.0f}",
                expected=f"a recording of {MOST_FRAMES:,} frames at most, gaps included",
            )
        if not (math.isfinite(self.rate_hz) and self.rate_hz >= 0.0):
            raise DataError(f"the frame rate is {self.rate_hz}", expected="a positive number of Hz")

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.frames)


def unique_labels(names: Sequence[str]) -> tuple[str, ...]:
    """Names without surrounding space; those that are repeated get ``#1``, ``#2``, and so on."""
    stripped = [name.strip() for name in names]
    total = Counter(stripped)
    used: Counter[str] = Counter()
    labels = []
    for name in stripped:
        used[name] += 1
        labels.append(f"{name}#{used[name]}" if total[name] > 1 else name)
    return tuple(labels)


def bare(label: str) -> str:
    """A label without the subject before the last colon and without the number of a repeat."""
    return label.rpartition(":")[2].partition("#")[0].strip()


def subject_of(label: str) -> str:
    """What stands before the last colon of a label; empty without one."""
    return label.rpartition(":")[0].strip()
