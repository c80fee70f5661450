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
NEW_TASK = "leave-one-task-out"
PROTOCOLS = (WITHIN, LEAVE_ONE_OUT, NEW_TASK)
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
            # A task that was left out cannot be learnt from, though it be told.
            if self.group_by == "task" and self.protocol != NEW_TASK:
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
        share = {WITHIN: track.side, LEAVE_ONE_OUT: "", NEW_TASK: track.task}[protocol]
        key = (track.subject, share)
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
            expected={
                WITHIN: "two recordings of a subject and side",
                LEAVE_ONE_OUT: "recordings of two subjects",
                NEW_TASK: "recordings of two subjects and two tasks that they name",
            }[protocol],
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
    others = [r for r in recordings if r.teaches and r.track.subject != own.subject]
    if protocol == LEAVE_ONE_OUT:
        return others
    return [r for r in others if r.track.task != own.task]


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
        of the recording and of its reach; ``noticed/<observed>`` (n,): whether our predictor had
        noticed the reach by then; ``belief/<observed>`` (n, 2): its duration less the true one, both from
        rest to rest [s], and whether the true task is the likeliest to it; ``tube_now/<observed>`` (n,),
        ``tube_mean/<observed>`` and ``tube_sd/<observed>`` (n, K, 3): what it predicted.
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


@dataclass(frozen=True, eq=False)
class Moment:
    """A reach at the time from which the rest of it is predicted.

    Args:
        recording: Recording.
        reach: One of its reaches.
        ours: What our predictor says.
        plain: What it says without a library.
    """

    recording: Recording
    reach: Reach
    ours: Cut
    plain: Cut

    def forecaster(self, name: str, learnt: Learnt) -> Callable[[Array], Forecast]:
        """The forecast of one predictor, for times on the clock of the track.

        While a reach has not been noticed, those that are told nothing hold like ours.
        """
        if name == OURS:
            return self.ours.forecast
        told = name.endswith((TOLD_DURATION, TOLD_TASK))
        onset = self.reach.onset_s if told else self.ours.onset_s
        track = self.recording.track
        begun = self.ours.now_s > float(track.time_s[0])
        if name == CONSTANT_VELOCITY or onset is None or not begun:
            return self.plain.forecast
        seen = Observation(
            track.slice(float(track.time_s[0]), self.ours.now_s),
            onset,
            self.reach.duration_s if told else None,
        )
        baseline = learnt.baseline(name, track.side, track.task)
        return lambda times: baseline.forecast(seen, times)


def _evaluate_recording(
    recording: Recording, number: int, learnt: Learnt
) -> dict[str, list[Array]]:
    settings, track = learnt.settings, recording.track
    times = cut_times(recording.reaches, settings.observed)
    ours, our_spans = replay(learnt.ours, track, times)
    plain, plain_spans = replay(learnt.constant_velocity, track, times)
    replayed = {OURS: our_spans, CONSTANT_VELOCITY: plain_spans}
    rows: dict[str, list[Array]] = {}

    def note(name: str, value: Array) -> None:
        rows.setdefault(name, []).append(value)

    count = len(settings.observed)
    for i, reach in enumerate(recording.reaches):
        note("reach", np.array([number, i]))
        own = slice(i * count, (i + 1) * count)
        for share, our_cut, plain_cut in zip(settings.observed, ours[own], plain[own], strict=True):
            moment = Moment(recording, reach, our_cut, plain_cut)
            judge = _Judge(recording, reach, our_cut.now_s, settings.config)
            tube = our_cut.forecast(our_cut.now_s + judge.steps)
            note(f"noticed/{share:g}", np.array(float(our_cut.onset_s is not None)))
            whole = recording.durations_s[i]
            note(f"belief/{share:g}", our_cut.belief(whole, track.task))
            note(f"tube_now/{share:g}", np.array(our_cut.now_s))
            note(f"tube_mean/{share:g}", tube.mean)
            note(f"tube_sd/{share:g}", np.sqrt(np.diagonal(tube.covariance, axis1=1, axis2=2)))
            for name in settings.predictors:
                found, seconds = judge.judge(moment.forecaster(name, learnt))
                # Ours are timed sample by sample, once for all reaches of the recording.
                spans = np.array([seconds])
                found["latency"] = (
                    (replayed[name] if i == 0 else spans[:0]) if name in replayed else spans
                )
                for field in FIELDS:
                    note(f"{name}/{share:g}/{field}", found[field])
    return rows


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

    def judge(self, forecast: Callable[[Array], Forecast]) -> tuple[Arrays, float]:
        """Score a forecast for the rest of the reach; also how long it took [s]."""
        begin = time.perf_counter()
        whole = forecast(self._times)
        seconds = time.perf_counter() - begin
        parts = (slice(0, self._count), slice(self._count, -1), slice(-1, None))
        ahead, horizons, end = (Forecast(whole.mean[p], whole.covariance[p]) for p in parts)
        truth, later, last = (self._truth[p] for p in parts)
        return score(end, last, ahead, truth, horizons, later), seconds
