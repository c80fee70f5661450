"""What pictures and videos are made from: plain arrays of one run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_sim.scenario.schema import Scenario

FloatArray = NDArray[np.float64]
HOLE_S = 0.1
"""States of the simulator (250 a second) that are farther apart leave a gap in a recording [s]."""


def holes(time_s: FloatArray) -> NDArray[np.intp]:
    """Indices of the samples (N,) [s] after which nothing was recorded for a while."""
    return np.flatnonzero(np.diff(time_s) > HOLE_S)


@dataclass(frozen=True)
class ReachMark:
    """One reach of the run.

    Attributes:
        start_s: When the robot set off [s].
        end_s: When it arrived, or gave up [s].
        label: Short name in the plots.
    """

    start_s: float
    end_s: float
    label: str = ""


@dataclass(frozen=True)
class PredictionMark:
    """One prediction of an arm that was made during the run.

    Attributes:
        time_s: Capture time of the newest sample it used [s].
        mean: Predicted keypoints at K instants (K, 4, 3) [m].
        sigma: Their standard deviation along the worst direction (K, 4) [m].
        body_id: Whose arm.
    """

    time_s: float
    mean: FloatArray
    sigma: FloatArray
    body_id: str = "person1"


@dataclass(frozen=True)
class BaselineTrack:
    """The same scene without replanning: the robot's nominal motion, the same people.

    Attributes:
        time_s: (M,) [s], on the clock of the run.
        q: Joint angles (M, 7) [rad].
        clearance_m: Smallest surface distance robot-person (M,) [m].
    """

    time_s: FloatArray
    q: FloatArray
    clearance_m: FloatArray


@dataclass(frozen=True)
class RunRecord:
    """A run as arrays; all times in seconds on one clock, all positions in the world frame.

    Attributes:
        scenario: The scene: table, targets, people.
        time_s: Sample times (N,) [s], increasing.
        q: Joint angles (N, 7) [rad].
        arms: True keypoints of every arm of the scenario, in its order (N, A, 4, 3) [m]; NaN where an
            arm was not there.
        clearance_m: Smallest signed surface distance robot-person (N,) [m]; infinite or NaN where
            nobody was there.
        reaches: The reaches, in order.
        predictions: Some or all predictions, in the order of time.
        baseline: The run without replanning, when it is known.
        title: Heading of picture and video.
        goals: Where the robot was sent (M, 3) [m], when that was seen; none: to the targets of the
            scenario's reaches.

    Raises:
        DataError: when lengths do not fit or times do not increase.
    """

    scenario: Scenario
    time_s: FloatArray
    q: FloatArray
    arms: FloatArray
    clearance_m: FloatArray
    reaches: tuple[ReachMark, ...] = ()
    predictions: tuple[PredictionMark, ...] = ()
    baseline: BaselineTrack | None = None
    title: str = ""
    goals: FloatArray | None = None

    @property
    def goal_places(self) -> FloatArray:
        """Where the robot was sent (M, 3) [m]."""
        if self.goals is not None:
            return self.goals
        names = sorted({reach.robot_target for reach in self.scenario.reaches})
        return np.array([self.scenario.targets[name] for name in names]).reshape(-1, 3)

    def __post_init__(self) -> None:
        """Check shapes and times."""
        n, arms = len(self.time_s), len(self.scenario.arms)
        if n < 2 or not (np.diff(self.time_s) > 0.0).all():
            raise DataError(f"run has {n} sample times", expected="two or more, increasing")
        shapes = {
            "q": (self.q, (n, 7)),
            "arms": (self.arms, (n, arms, 4, 3)),
            "clearance_m": (self.clearance_m, (n,)),
        }
        if self.baseline is not None:
            m = len(self.baseline.time_s)
            shapes["baseline.q"] = (self.baseline.q, (m, 7))
            shapes["baseline.clearance_m"] = (self.baseline.clearance_m, (m,))
        for name, (array, shape) in shapes.items():
            if array.shape != shape:
                raise DataError(f"run's {name} has shape {array.shape}", expected=str(shape))
        if not np.isfinite(self.q).all():
            raise DataError("run's q holds numbers that are not finite")

    def closest(self) -> int:
        """Index of the smallest clearance (of the middle when nobody was ever there)."""
        finite = np.where(np.isfinite(self.clearance_m), self.clearance_m, np.inf)
        return int(finite.argmin()) if np.isfinite(finite).any() else len(finite) // 2

    def reach_at(self, time_s: float) -> ReachMark:
        """The reach that runs at a time, or the nearest one; the whole run without marks."""
        if not self.reaches:
            return ReachMark(float(self.time_s[0]), float(self.time_s[-1]))

        def distance(reach: ReachMark) -> float:
            return max(reach.start_s - time_s, time_s - reach.end_s, 0.0)

        return min(self.reaches, key=distance)

    def prediction_near(self, time_s: float, tolerance_s: float = 0.25) -> PredictionMark | None:
        """The prediction made nearest to a time, if one lies within the tolerance [s]."""
        if not self.predictions:
            return None
        nearest = min(self.predictions, key=lambda mark: abs(mark.time_s - time_s))
        return nearest if abs(nearest.time_s - time_s) <= tolerance_s else None

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Joint angles (F, 7), arms (F, A, 4, 3) and clearance (F,) at any times, interpolated."""
        right = np.clip(np.searchsorted(self.time_s, times), 1, len(self.time_s) - 1)
        left = right - 1
        share = (times - self.time_s[left]) / (self.time_s[right] - self.time_s[left])
        share = np.clip(share, 0.0, 1.0)

        def mix(values: FloatArray) -> FloatArray:
            weight = share.reshape(-1, *[1] * (values.ndim - 1))
            result: FloatArray = values[left] + weight * (values[right] - values[left])
            return result

        with np.errstate(invalid="ignore"):
            return mix(self.q), mix(self.arms), mix(self.clearance_m)
