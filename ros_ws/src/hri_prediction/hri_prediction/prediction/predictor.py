"""Online prediction of one arm: idle, reaching, or invalid."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.bank import BankPrior, HypothesisBank, bank_prior
from hri_prediction.prediction.calibration import OnlineCalibration
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.constant_velocity import constant_velocity
from hri_prediction.prediction.input_check import LATE, InputCheck
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.prediction.live_scores import LiveFigures
from hri_prediction.prediction.output import Prediction, ReachState, whole_arm, within_reach
from hri_prediction.tracks.rate import too_slow
from hri_prediction.tracks.segmentation import ROUNDING_S, ReachSegmenter
from hri_prediction.tracks.track import ArmSample

Array = NDArray[np.float64]
CALIBRATION_STEP_S = 0.1
"""Distance of the horizons at which predictions are compared with what came [s]."""


class ReachPredictor:
    """Predicts one arm from its samples.

    Idle: the arm rests where it is. At the onset of a reach (found with a delay and back-dated) a
    bank of hypotheses is started on the buffered samples; while it lasts, the mixture of the bank
    is the prediction. Without a library a reach continues at constant velocity.

    Args:
        library: Known tasks, or None.
        config: Settings.
    """

    def __init__(
        self, library: TaskLibrary | None = None, config: PredictorConfig | None = None
    ) -> None:
        self.library = library
        self.config = config or PredictorConfig()
        self._priors: dict[str, BankPrior] = {}
        self._banks: dict[str, HypothesisBank] = {}
        lengths = (library.upper_arm_m, library.forearm_m) if library else (0.0, 0.0)
        self.counters: dict[str, int] = {}
        self._check = InputCheck(self.config, *lengths, counters=self.counters)
        self._segmenter = ReachSegmenter(self.config.segmentation)
        self._points = 1 + round(self.config.horizon / self.config.step)
        self._times: Array = np.asarray(np.arange(self._points) * self.config.step, dtype=float)
        self._calibration = OnlineCalibration(
            CALIBRATION_STEP_S,
            max(1, min(10, int(self.config.horizon / CALIBRATION_STEP_S))),
            self.config.calibration_rate,
            self.config.calibration_limit,
        )
        place = np.arange(1, self._calibration.count + 1) * (CALIBRATION_STEP_S / self.config.step)
        self._lower = np.minimum((place + 1e-9).astype(int), self._points - 2)
        self._share: Array = np.minimum(place - self._lower, 1.0)
        self._know()
        self.reset()

    def _know(self, only: str = "") -> None:
        """Make priors of what is known, of both arms or of one."""
        if self.library is not None:
            for side in ("left", "right"):
                if only and side != only and side in self._banks:
                    continue
                self._priors[side] = bank_prior(self.library.for_side(side), self.config)
                self._banks[side] = HypothesisBank(self._priors[side], self.config)

    def reset(self) -> None:
        """Forget the person; counters and library stay."""
        self._check.reset()
        self._calibration.reset()
        self._forget()

    def _forget(self) -> None:
        self._segmenter.reset()
        self._calibration.forget_pending()
        self._buffer: deque[tuple[float, Array]] = deque()
        self._finished: tuple[int, int] | None = None
        self._known = np.full((4, 3), math.nan)
        self._hand: Array | None = None
        self._forearm = np.zeros(3)
        self._side = ""
        self._epoch: int | None = None
        self._newest = 0
        self._latest = 0
        self._usable_s = -math.inf
        self._reason = ""
        self._reaching = False
        self._from_rest = False
        self._onset_s = 0.0
        self._reference = np.zeros(3)
        self._updated_s = -math.inf
        self._current = np.full((4, 3), math.nan)

    # -- input ------------------------------------------------------------------------------

    def observe(self, sample: ArmSample) -> None:
        """Take one sample; faults are counted and kept out, never raised."""
        verdict = self._check.check(sample)
        self._count("samples")
        if verdict.reason == LATE:
            return
        if verdict.restart:
            self._count("restarts")
            self._forget()
            self._newest = 0
        if self._epoch is None:
            self._epoch = sample.stamp_ns
        self._side = sample.side
        self._latest = sample.stamp_ns
        if verdict.usable[1] or verdict.usable[2] or not self._newest:
            # A sample of which nothing is used must not make the prediction look fresh.
            self._newest = sample.stamp_ns
        self._reason = verdict.reason
        now = (sample.stamp_ns - self._epoch) * 1e-9
        points = np.where(verdict.usable[:, None], sample.keypoints, math.nan)
        self._current = points
        self._remember(points, verdict.usable)
        if not (verdict.usable[1] or verdict.usable[2]):
            return
        missed = now - self._usable_s if self._usable_s > -math.inf else 0.0
        if missed > self.config.max_gap + ROUNDING_S:
            self._reason = f"restarted after {missed:.2f} s without the arm"
            self._count("gaps")
            self._stop()
            self._buffer.clear()
        self._usable_s = now
        self._buffer.append((now, points))
        while now - self._buffer[0][0] > self.config.buffer_time + ROUNDING_S:
            self._buffer.popleft()
        event = None
        if verdict.usable[2]:
            self._calibration.seen(now, points[2])
            event = self._segmenter.push(now, points[2])
            if not verdict.reason:
                self._reason = too_slow(self._segmenter.period_s) or self._reason
        if event is not None and event.kind == "end":
            self._finish(event.time_s)
        if event is not None and event.kind == "onset":
            # There and back again without a rest: the second part begins in mid-air.
            self._from_rest = not self._reaching
            self._begin(event.time_s)
        elif event is not None:
            self._stop()
        elif self._reaching:
            self._update(now, points)

    def _remember(self, points: Array, usable: NDArray[np.bool_]) -> None:
        self._known[usable] = points[usable]
        if usable[1:].all():
            self._hand = points[3] - points[2]
            self._forearm = points[2] - points[1]

    def _begin(self, onset_s: float) -> None:
        """Start the bank at the onset and feed it what the buffer holds since."""
        self._count("reaches")
        self._reaching = True
        self._onset_s = onset_s
        self._updated_s = -math.inf
        self._reference = self._shoulder_at(onset_s)
        if self.library is None:
            return
        self._banks[self._side].restart()
        # Counted back from the newest, so that the newest sample is always among those used.
        chosen = []
        due = math.inf
        for time_s, points in reversed(self._buffer):
            if time_s < onset_s - 0.5 * self.config.update_interval - ROUNDING_S:
                break
            if time_s <= due + ROUNDING_S:
                chosen.append((time_s, points))
                due = time_s - self.config.update_interval
        for time_s, points in reversed(chosen):
            self._update(time_s, points)

    def _finish(self, time_s: float) -> None:
        """Note a reach from rest to rest that is over, if it took as long as reaches do."""
        if self._reaching and self._from_rest and time_s - self._onset_s >= self.config.min_reach:
            assert self._epoch is not None
            onset_ns, end_ns = round(1e9 * self._onset_s), round(1e9 * time_s)
            self._finished = self._epoch + onset_ns, self._epoch + end_ns

    def _stop(self) -> None:
        self._reaching = False

    def _shoulder_at(self, time_s: float) -> Array:
        """Mean of the shoulder within 20 ms of a time, else the nearest seen, else the last."""
        seen = [(abs(t - time_s), p[0]) for t, p in self._buffer if not math.isnan(p[0, 0])]
        if not seen:
            return self._known[0].copy()
        near = [p for gap, p in seen if gap <= 0.02 + ROUNDING_S]
        if near:
            mean: Array = np.mean(near, axis=0)
            return mean
        return min(seen, key=lambda item: item[0])[1].copy()

    def _update(self, time_s: float, points: Array) -> None:
        """Condition the bank, at most once every ``update_interval``."""
        if self.library is None or math.isnan(self._reference[0]):
            return
        if time_s - self._updated_s < self.config.update_interval - ROUNDING_S:
            return
        self._updated_s = time_s
        value = (points[1:3] - self._reference).ravel()
        seen = np.isfinite(value)
        failed = self._banks[self._side].observe(
            time_s - self._onset_s, np.where(seen, value, 0.0), seen
        )
        if failed:
            self._count("failed hypotheses", failed)
        if time_s == self._usable_s:  # not for samples from before the onset was noticed
            # From the published points: how far pace widens them depends on their distance.
            mean, covariance = self._from_bank(time_s, self._times)
            self._calibration.predicted(
                time_s, self._at_compared(mean[:, 1]), self._at_compared(covariance[:, 1])
            )

    def _at_compared(self, path: Array) -> Array:
        """What is published (K, ...), at the horizons that are compared (in between, on the line)."""
        begin = path[self._lower]
        return begin + np.einsum("k,k...->k...", self._share, path[self._lower + 1] - begin)

    def _count(self, name: str, by: int = 1) -> None:
        self.counters[name] = self.counters.get(name, 0) + by

    # -- output -----------------------------------------------------------------------------

    def live_figures(self) -> dict[float, LiveFigures]:
        """How good the newest predictions of reaches were, by horizon [s]; none without a library."""
        return self._calibration.scores.figures()

    def take_finished(self) -> tuple[int, int] | None:
        """When the newest finished reach passed the onset speed, up and down [ns]; each is told once."""
        found, self._finished = self._finished, None
        return found

    @property
    def reaching(self) -> bool:
        """Whether a reach is under way."""
        return self._reaching

    def expect(self, library: TaskLibrary) -> bool:
        """Know other tasks from now on; not in the midst of a reach. Returns whether they are known."""
        if self._reaching:
            return False
        self.library = library
        self._know(self._side)
        return True

    @property
    def current(self) -> Array:
        """Keypoints (4, 3) of the newest sample that are used [m]; NaN where they are not."""
        return self._current

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest sample used, which the next prediction will bear; 0 before any [ns]."""
        return self._newest

    def predict(self, now_ns: int | None = None) -> Prediction | None:
        """The prediction from the newest sample on, or None until shoulder and wrist were seen.

        What it says follows from the samples alone, whenever and however often it is asked for; the
        present time only decides whether the state is INVALID.

        Args:
            now_ns: Present time on the samples' clock, to notice that samples stopped coming;
                default: the time of the newest sample.
        """
        if self._epoch is None or np.isnan(self._known[[0, 2]]).any():
            return None
        newest = (self._newest - self._epoch) * 1e-9
        latest = (self._latest - self._epoch) * 1e-9
        now = latest if now_ns is None else max(newest, (now_ns - self._epoch) * 1e-9)
        state = ReachState.REACHING if self._reaching else ReachState.IDLE
        reason = self._reason
        age = now - self._usable_s
        if age > self.config.stale_time + ROUNDING_S:
            state = ReachState.INVALID
            text = f"no usable sample for {age:.2f} s" if math.isfinite(age) else "arm not seen"
            reason = f"{text} ({reason})" if reason else text
        elbow_wrist = self._resting()
        moving = state == ReachState.REACHING
        if moving and self._bank_ready():
            mean, covariance = self._from_bank(newest, self._times)
            covariance *= self._calibration.factors(self._times)[:, None, None, None]
        elif moving:
            mean, covariance = self._constant_velocity(elbow_wrist)
        else:
            # By the samples' clock: how late this is asked for must not change what is said.
            mean, covariance = self._hold(elbow_wrist, min(max(latest - self._usable_s, 0.0), 10.0))
        resting = elbow_wrist - self._known[0]
        lengths = np.linalg.norm(np.diff(np.vstack((np.zeros(3), resting)), axis=0), axis=1)
        mean = within_reach(self._known[0], mean, float(lengths[0]), float(lengths[1]))
        forearm = self._forearm
        if self._hand is None:
            forearm = elbow_wrist[1] - elbow_wrist[0]
            hand = forearm * (self.config.hand_length / max(float(np.linalg.norm(forearm)), 1e-6))
        else:
            hand = self._hand
        full, spread = whole_arm(
            self._known[0],
            mean,
            covariance,
            hand,
            forearm,
            self.config.shoulder_sd,
            self.config.hand_sd,
        )
        names, probabilities, duration = self._belief(moving)
        return Prediction(
            stamp_ns=self._newest,
            state=state,
            reason=reason,
            side=self._side,
            times_s=self._times.copy(),
            mean=full,
            covariance=spread,
            onset_ns=self._left_rest_ns() if moving else 0,
            duration_mean_s=duration[0],
            duration_std_s=duration[1],
            task_names=names,
            task_probabilities=probabilities,
        )

    @property
    def crossing_ns(self) -> int | None:
        """When the wrist of the present reach passed the onset speed: what the segmentation cuts at."""
        if not self._reaching or self._epoch is None:
            return None
        return self._epoch + round(self._onset_s * 1e9)

    def _left_rest_ns(self) -> int:
        lead_s = self._priors[self._side].lead_s if self.library is not None else 0.0
        assert self._epoch is not None
        return self._epoch + round((self._onset_s - lead_s) * 1e9)

    def _resting(self) -> Array:
        """Last known elbow and wrist (2, 3); an elbow never seen is put half way."""
        elbow, wrist = self._known[1], self._known[2]
        if math.isnan(elbow[0]):
            elbow = 0.5 * (self._known[0] + wrist)
        return np.stack([elbow, wrist])

    def _bank_ready(self) -> bool:
        return self.library is not None and self._updated_s > -math.inf

    def _belief(self, moving: bool) -> tuple[tuple[str, ...], Array, tuple[float, float]]:
        if self.library is None:
            return (), np.zeros(0), (0.0, 0.0)
        bank = self._banks[self._side]
        if moving and self._bank_ready():
            return bank.prior.names, bank.task_probabilities(), bank.duration()
        prior = np.bincount(bank.prior.tasks, np.exp(bank.prior.log_prior))
        return bank.prior.names, prior / prior.sum(), (0.0, 0.0)

    def _from_bank(self, now: float, times: Array) -> tuple[Array, Array]:
        """Elbow and wrist at ``now + times``, evenly spaced from 0: (K, 2, 3) and (K, 2, 3, 3)."""
        step = float(times[1])
        mean, covariance = self._banks[self._side].moments(now - self._onset_s, step, len(times))
        mean += self._reference
        # People speed up and slow down within a reach; a bank of constant paces cannot know.
        drift = np.gradient(mean, step, axis=0)
        drift *= (self.config.pace_sd * times)[:, None, None]
        covariance += drift[..., :, None] * drift[..., None, :]
        # What the model cannot follow, and samples newer than the last update: the path begins
        # at the newest sample and returns to the model within anchor_time.
        offset = self._current[1:3] - mean[0]
        offset[np.isnan(offset)] = 0.0
        fade = np.exp(-times / max(self.config.anchor_time, 1e-6))
        mean += fade[:, None, None] * offset
        covariance *= self.config.inflation
        covariance += np.eye(3) * self.config.noise_sd**2
        return mean, covariance

    def _hold(self, elbow_wrist: Array, unseen: float) -> tuple[Array, Array]:
        """A resting arm: (K, 2, 3) and (K, 2, 3, 3); ``unseen`` [s] is how long it has been so."""
        mean = np.broadcast_to(elbow_wrist, (self._points, 2, 3)).copy()
        growth = self.config.idle_growth * self._times + self.config.max_speed * 0.1 * unseen
        variance = self.config.idle_sd**2 + growth**2
        covariance = np.broadcast_to(
            variance[:, None, None, None] * np.eye(3), (self._points, 2, 3, 3)
        )
        return mean, covariance.copy()

    def _constant_velocity(self, elbow_wrist: Array) -> tuple[Array, Array]:
        since = self._usable_s - self.config.velocity_window - ROUNDING_S
        recent = [(t, p[1:3].ravel()) for t, p in self._buffer if t >= since]
        return constant_velocity(recent, elbow_wrist, self._times, self.config)
