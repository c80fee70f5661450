"""What the hybrid loop is to know of an arm that is followed: where it rests, and reaches that ended."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.errors import DataError
from hri_prediction.hybrid.body import BodyArm, facing_towards
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import Rest, SeenReach
from hri_prediction.motor_control.seen import MAX_GAP_S
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import demonstration
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample, ArmTrack

Array = NDArray[np.float64]

_KEPT = 4096
"""Samples: 16 s at 250 Hz. Longer reaches are not learnt."""
_MEASURED = 100
"""Samples that lengths of an arm are the medians of; before there are so many, it is not known."""
_REST_NS = 100_000_000
_STILL_M = 0.008
"""An arm rests whose wrist has been idle, and within this distance, for so long."""
_AROUND_NS = 100_000_000
_SELDOM_NS = 200_000_000
"""Between two questions about a resting arm."""
_ELSEWHERE_M = 0.15
"""Whose shoulder is so far from where it was sits elsewhere, and is measured anew."""


class ArmWatch:
    """Looks on while a predictor follows an arm.

    Args:
        side: Which arm.
        targets: Where the tip of the hand may end, by name (3,) [m], in the world.
        predictor: Settings of the predictor.
        config: Of the hybrid.
        facing_rad: Where the person faces in the world; none: where the targets are.
    """

    def __init__(
        self,
        side: str,
        targets: Mapping[str, Array],
        predictor: PredictorConfig,
        config: HybridConfig,
        facing_rad: float | None = None,
    ) -> None:
        self.side = side
        self._targets = np.array(list(targets.values()))
        self._predictor, self._config = predictor, config
        self._facing = facing_rad
        self._stamps = np.zeros(_KEPT, dtype=np.int64)
        self._points = np.full((_KEPT, 4, 3), np.nan)
        self._count = 0
        self._body: BodyArm | None = None
        self._seat = np.full(3, np.nan)
        self._idle_since: int | None = None
        self._anchor = np.full(3, np.nan)
        self._told: Array | None = None
        self._told_ns = -_SELDOM_NS
        self._questions: list[Rest | SeenReach] = []
        self.unusable = 0

    def observe(self, sample: ArmSample, predictor: ReachPredictor) -> None:
        """Take a sample that the predictor has taken before."""
        if self._count:
            back_ns = int(self._stamps[(self._count - 1) % _KEPT]) - sample.stamp_ns
            if 0 <= back_ns < 1e9 * self._predictor.stale_time:
                return  # late or repeated
            if back_ns > 0:
                self._count = 0  # the clock went back: what was before is another recording
        points = predictor.current
        place = self._count % _KEPT
        self._stamps[place] = sample.stamp_ns
        self._points[place] = points
        self._count += 1
        finished = predictor.take_finished()
        if finished is not None:
            self._reached(*finished)
        if predictor.reaching:
            self._told = None  # wherever it comes to rest, that is another question
        wrist = points[2]
        if np.isnan(wrist[0]):
            return
        # A reach is noticed when it has gone on for a while: what moves does not rest.
        still = bool(np.abs(wrist - self._anchor).max() < _STILL_M)
        if predictor.reaching:
            self._idle_since = None
        elif self._idle_since is None or self._idle_since > sample.stamp_ns or not still:
            self._idle_since = sample.stamp_ns
            self._anchor = wrist
        elif sample.stamp_ns - self._idle_since >= _REST_NS:
            self._rests(sample.stamp_ns, points)

    def questions(self) -> list[Rest | SeenReach]:
        """What is to be told since last asked."""
        found, self._questions = self._questions, []
        return found

    def _rests(self, stamp_ns: int, seen: Array) -> None:
        if not np.isfinite(seen[:3]).all() or 0 <= stamp_ns - self._told_ns < _SELDOM_NS:
            return
        if self._told is not None and (
            np.linalg.norm(seen[:3] - self._told, axis=1).max() < 0.5 * self._config.moved
        ):
            return
        body = self._known_body()
        if body is None:
            return
        self._told, self._told_ns = np.array(seen[:3]), stamp_ns
        self._questions.append(Rest(body, self._whole(seen)))

    def _reached(self, onset_ns: int, end_ns: int) -> None:
        """Cut out a reach; it is left out where too little of it was seen."""
        self._told = None  # what may come next is another question now
        body = self._known_body()
        stamps, points = self._newest()
        inside = (stamps >= onset_ns - _AROUND_NS) & (stamps <= end_ns + _AROUND_NS)
        if body is None or np.count_nonzero(inside) < 2 or stamps[0] > onset_ns:
            self.unusable += 1
            return
        times: Array = np.asarray(1e-9 * (stamps[inside] - onset_ns), dtype=float)
        try:
            track = ArmTrack(times, points[inside], side=self.side)
            duration_s = 1e-9 * (end_ns - onset_ns)
            _check_seen(track, duration_s)
            demo = demonstration(track, 0.0, duration_s, self._predictor.demonstration_points)
            first, last = self._nearest(track, 0.0), self._nearest(track, duration_s)
        except DataError:
            self.unusable += 1
            return
        self._questions.append(
            SeenReach(body, demo.phases, demo.values, first[0], first[3], last[3], duration_s)
        )

    def _nearest(self, track: ArmTrack, time_s: float) -> Array:
        """The whole arm nearest to a time."""
        seen = np.flatnonzero(np.isfinite(track.keypoints[:, :3]).all(axis=(1, 2)))
        if not len(seen):
            raise DataError("shoulder, elbow and wrist are never seen together")
        off_s = np.abs(track.time_s[seen] - time_s)
        row = seen[off_s.argmin()]
        if off_s.min() > MAX_GAP_S:
            raise DataError(f"the arm is not seen within {off_s.min():.2f} s of {time_s:.2f} s")
        return self._whole(track.keypoints[row])

    def _whole(self, points: Array) -> Array:
        """An arm (4, 3) with a tip: along the forearm, where it was not seen."""
        if np.isfinite(points[3]).all():
            return np.array(points)
        forearm = points[2] - points[1]
        length = self._body.hand_m if self._body is not None else self._predictor.hand_length
        found = np.array(points)
        found[3] = points[2] + forearm * (length / max(float(np.linalg.norm(forearm)), 1e-6))
        return found

    def _newest(self) -> tuple[NDArray[np.int64], Array]:
        """What is kept, the oldest first."""
        kept = min(self._count, _KEPT)
        order = np.arange(self._count - kept, self._count) % _KEPT
        return self._stamps[order], self._points[order]

    def _known_body(self) -> BodyArm | None:
        """The arm with its lengths, once enough was seen of it."""
        shoulder = self._points[(self._count - 1) % _KEPT, 0]
        moved = float(np.linalg.norm(shoulder - self._seat))
        if (self._body is None or moved > _ELSEWHERE_M) and self._count >= _MEASURED:
            _, points = self._newest()
            points = points[-_MEASURED:]
            shoulders = points[:, 0][np.isfinite(points[:, 0]).all(axis=1)]
            if not len(shoulders):
                return None
            self._seat = np.median(shoulders, axis=0)
            facing = self._facing
            if facing is None:
                facing = facing_towards(np.median(shoulders, axis=0), self._targets)
            try:
                self._body = BodyArm.measured(
                    points, self.side, facing, self._predictor.hand_length
                )
            except DataError:
                return None
        return self._body


def _check_seen(track: ArmTrack, duration_s: float) -> None:
    """Whether shoulder, elbow and wrist were seen all the time from 0 to an end [s]: no gap is made up for.

    Raises:
        DataError: one of them was not.
    """
    for keypoint, name in enumerate(KEYPOINTS[:3]):
        seen = np.isfinite(track.keypoints[:, keypoint]).all(axis=1)
        times = np.clip(track.time_s[seen], 0.0, duration_s)
        gap_s = float(np.diff(times, prepend=0.0, append=duration_s).max())
        if gap_s > MAX_GAP_S:
            raise DataError(
                f"the {name} is not seen for {gap_s:.2f} s",
                expected=f"gaps of {MAX_GAP_S} s at most",
            )
