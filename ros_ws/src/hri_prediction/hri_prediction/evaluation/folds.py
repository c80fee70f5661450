"""Who is predicted after learning from whom, and the work on one such share."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.evaluation.baselines import Baseline, MeanTrajectory, MinimumJerk, PlainProMP
from hri_prediction.evaluation.observation import Example, Observation, examples, fitting
from hri_prediction.evaluation.recordings import Recording, truth_at
from hri_prediction.evaluation.replay import Cut, Forecast, replay
from hri_prediction.evaluation.scores import FIELDS, HORIZONS_S, score
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.prediction.training import train
from hri_prediction.tracks.segmentation import Reach
from hri_prediction.warm import warm_kernels

Array = NDArray[np.float64]
Arrays = dict[str, Array]
WITHIN, LEAVE_ONE_OUT = "within", "leave-one-subject-out"
PROTOCOLS = (WITHIN, LEAVE_ONE_OUT)
OURS, CONSTANT_VELOCITY = "promp", "constant_velocity"
TOLD_DURATION, TOLD_TASK = "_told_duration", "_told_task"
BASELINES: dict[str, Callable[[Sequence[Example]], Baseline]] = {
    "minimum_jerk": MinimumJerk,
    "mean_trajectory": MeanTrajectory,
    "movement_primitives": PlainProMP,
}


@dataclass(frozen=True)
class Settings:
    """What is evaluated, and how.

    Args:
        protocol: One of `PROTOCOLS`.
        observed: Shares of the reaches that are seen before the rest is predicted, increasing.
        config: Settings of the predictor and of its training.
        group_by: What names a task, see :func:`~hri_prediction.prediction.training.train`.
        references: Whether the package ``movement_primitives`` takes part.
    """

    protocol: str
    observed: tuple[float, ...]
    config: PredictorConfig
    group_by: str
    references: bool

    @property
    def predictors(self) -> tuple[str, ...]:
        """Names of all predictors, in the order of tables."""
        names = [OURS, CONSTANT_VELOCITY]
        for name in BASELINES:
            if name == "movement_primitives" and not self.references:
                continue
            names += [name, name + TOLD_DURATION]
            if self.group_by == "task":
                names.append(name + TOLD_TASK)
        return tuple(names)


@dataclass(frozen=True)
class Fold:
    """A share of the work.

    Args:
        key: Name, fit for a file.
        tests: Indices of the recordings that are predicted.
    """

    key: str
    tests: tuple[int, ...]


def make_folds(recordings: Sequence[Recording], protocol: str) -> tuple[list[Fold], list[str]]:
    """The folds of a protocol, in the order of the recordings, and a line for each that cannot be.

    Raises:
        DataError: when none can be.
    """
    groups: dict[tuple[str, str], list[int]] = {}
    for index, recording in enumerate(recordings):
        if not recording.judged:
            continue
        track = recording.track
        key = (track.subject, track.side if protocol == WITHIN else "")
        groups.setdefault(key, []).append(index)
    folds, skipped = [], []
    for number, (key, tests) in enumerate(groups.items()):
        usable = tuple(
            i
            for i in tests
            if recordings[i].reaches and any(r.found for r in training(recordings, i, protocol))
        )
        if len(usable) < len(tests):
            name = " ".join(key).strip() or "subject without a name"
            skipped.append(
                f"{name}: {len(tests) - len(usable)} of {len(tests)} recordings without a reach, or "
                "without reaches to learn from"
            )
        if usable:
            folds.append(Fold(f"{number:03d}", usable))
    if not folds:
        raise DataError(
            f"nothing to evaluate {protocol}" + (f" ({skipped[0]})" if skipped else ""),
            expected="two recordings of a subject and side"
            if protocol == WITHIN
            else "recordings of two subjects",
        )
    return folds, skipped


def training(recordings: Sequence[Recording], test: int, protocol: str) -> list[Recording]:
    """What is learnt from before a recording is predicted; never that recording itself."""
    own = recordings[test].track
    if protocol == WITHIN:
        return [
            r
            for i, r in enumerate(recordings)
            if i != test and (r.track.subject, r.track.side) == (own.subject, own.side)
        ]
    return [r for r in recordings if r.teaches and r.track.subject != own.subject]


class Learnt:
    """All predictors of a fold, trained.

    Args:
        known: Recordings to learn from.
        settings: What takes part.
    """

    def __init__(self, known: Sequence[Recording], settings: Settings) -> None:
        self.settings = settings
        tracks = [recording.track for recording in known]
        library = train(tracks, settings.config, group_by=settings.group_by).library
        self.ours = ReachPredictor(library, settings.config)
        self.constant_velocity = ReachPredictor(None, settings.config)
        self._found = examples(known, labelled=False)
        self._labelled = examples(known, labelled=True)
        self._fitted: dict[tuple[str, str, str], Baseline] = {}

    def baseline(self, name: str, side: str, task: str) -> Baseline:
        """A simple predictor for one arm (and task, where it is told), learnt when first asked for."""
        told = task if name.endswith(TOLD_TASK) else None
        key = (name, side, told or "")
        if key not in self._fitted:
            kind = name.removesuffix(TOLD_TASK).removesuffix(TOLD_DURATION)
            known = self._found if kind == name else self._labelled
            self._fitted[key] = BASELINES[kind](fitting(known, side, told))
        return self._fitted[key]


def evaluate_fold(recordings: Sequence[Recording], fold: Fold, settings: Settings) -> Arrays:
    """Replay all reaches of a fold.

    Returns:
        ``<predictor>/<observed>/<field>`` to the `FIELDS` over the reaches; ``reach`` (n, 2): numbers
        of the recording and of its reach; ``detected/<observed>`` (n,): whether our predictor had
        noticed the reach by then; ``tube_now/<observed>`` (n,), ``tube_mean/<observed>`` and
        ``tube_sd/<observed>`` (n, K, 3): what it predicted.
    """
    warm_kernels()
    rows: dict[str, list[Array]] = {}
    learnt: Learnt | None = None
    for test in fold.tests:
        if learnt is None or settings.protocol == WITHIN:
            learnt = Learnt(training(recordings, test, settings.protocol), settings)
        for name, value in _evaluate_recording(recordings[test], test, learnt).items():
            rows.setdefault(name, []).extend(value)
    return {
        name: np.concatenate(values) if name.endswith("latency") else np.array(values)
        for name, values in rows.items()
    }


def cut_times(reaches: Sequence[Reach], observed: Sequence[float]) -> list[float]:
    """When the given shares of each reach are over, reach by reach."""
    return [reach.onset_s + share * reach.duration_s for reach in reaches for share in observed]


def _evaluate_recording(
    recording: Recording, number: int, learnt: Learnt
) -> dict[str, list[Array]]:
    settings, track = learnt.settings, recording.track
    times = cut_times(recording.reaches, settings.observed)
    ours, our_spans = replay(learnt.ours, track, times)
    plain, plain_spans = replay(learnt.constant_velocity, track, times)
    rows: dict[str, list[Array]] = {"reach": []}
    for i, reach in enumerate(recording.reaches):
        rows["reach"].append(np.array([number, i]))
        for j, share in enumerate(settings.observed):
            at = i * len(settings.observed) + j
            judge = _Judge(recording, reach, ours[at].now_s, settings.config)
            rows.setdefault(f"detected/{share:g}", []).append(
                np.array(ours[at].onset_s is not None, dtype=float)
            )
            tube = ours[at].forecast(ours[at].now_s + judge.steps)
            sd = np.sqrt(np.diagonal(tube.covariance, axis1=1, axis2=2))
            for name, value in (("now", np.array(ours[at].now_s)), ("mean", tube.mean), ("sd", sd)):
                rows.setdefault(f"tube_{name}/{share:g}", []).append(value)
            for name in settings.predictors:
                spans = np.zeros(0)
                if name in (OURS, CONSTANT_VELOCITY):
                    cut = ours[at] if name == OURS else plain[at]
                    found = judge.judge(cut.forecast)
                    if i == 0:
                        spans = our_spans if name == OURS else plain_spans
                else:
                    seen = _observation(recording, reach, ours[at], name)
                    if (
                        seen is None
                    ):  # the reach has not been noticed: all but ours know nothing better
                        found = judge.judge(plain[at].forecast)
                    else:
                        baseline = learnt.baseline(name, track.side, track.task)
                        found = judge.judge(
                            lambda t, b=baseline, s=seen: b.forecast(s, t)  # type: ignore[misc]
                        )
                        spans = np.array([judge.seconds])
                found["latency"] = spans
                for field in FIELDS:
                    rows.setdefault(f"{name}/{share:g}/{field}", []).append(found[field])
    return rows


def _observation(recording: Recording, reach: Reach, cut: Cut, name: str) -> Observation | None:
    """What a simple predictor gets to see and is told; none when no reach has been noticed."""
    told = name.endswith((TOLD_DURATION, TOLD_TASK))
    onset = reach.onset_s if told else cut.onset_s
    if onset is None:
        return None
    track = recording.track.slice(float(recording.track.time_s[0]), cut.now_s)
    return Observation(track, onset, reach.duration_s if told else None)


class _Judge:
    """What came after one cut, to hold forecasts against."""

    def __init__(
        self, recording: Recording, reach: Reach, now_s: float, config: PredictorConfig
    ) -> None:
        count = round(config.horizon / config.step)
        self.steps: Array = np.linspace(0.0, config.step * count, count + 1)
        self._times = np.concatenate(
            [
                now_s + self.steps[1:],
                now_s + np.array(HORIZONS_S),
                [reach.end_s],
            ]
        )
        self._count = count
        self._truth = truth_at(recording.track, self._times)
        self._truth[self._times > reach.end_s + 1e-6] = np.nan
        self.seconds = 0.0

    def judge(self, forecast: Callable[[Array], Forecast]) -> Arrays:
        """Score a forecast for the rest of the reach."""
        begin = time.perf_counter()
        whole = forecast(self._times)
        self.seconds = time.perf_counter() - begin
        parts = (slice(0, self._count), slice(self._count, -1), slice(-1, None))
        ahead, horizons, end = (Forecast(whole.mean[p], whole.covariance[p]) for p in parts)
        truth, later, last = (self._truth[p] for p in parts)
        return score(end, last, ahead, truth, horizons, later)
