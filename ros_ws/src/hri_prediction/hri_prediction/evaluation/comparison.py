"""Predictions that were recorded, held against those made offline from the same samples."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hri_prediction.bags.arms import arm_samples
from hri_prediction.bags.predictions import recorded_predictions
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.prediction.output import Prediction, ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample

TOLERANCE = 1e-9
"""Up to this difference numbers count as the same, each in its unit."""
FIGURES = ("mean [m]", "covariance [m²]", "onset, duration [s]", "task probability")
"""What is compared."""
_LONG_AFTER_NS = 10**15


@dataclass(frozen=True)
class Comparison:
    """Predictions of one arm, recorded and offline.

    Attributes:
        body: Id of the body, and the side where both of its arms were predicted.
        samples: Number of samples that the offline predictions were made from.
        recorded: How many of them the other bag holds too; of one bag alone, all.
        predictions: Number of recorded predictions.
        reaching: How many of them predict a reach.
        invalid: How many of them are INVALID.
        strange: How many have a stamp that is none of the samples'.
        different: How many say something else than the offline prediction.
        largest: Largest difference of each of ``FIGURES``; infinite where state, side, tasks or
            times are others.
        first_s: When the first strange or different one was made, from the first sample on [s];
            None when there is none.
    """

    body: str
    samples: int
    recorded: int
    predictions: int
    reaching: int
    invalid: int
    strange: int
    different: int
    largest: tuple[float, ...]
    first_s: float | None

    @property
    def same(self) -> bool:
        """Whether all recorded predictions are those made offline."""
        return self.strange == 0 and self.different == 0


def predict_bag(
    bag: str | Path, library: TaskLibrary | None = None, config: PredictorConfig | None = None
) -> Iterator[tuple[str, Prediction]]:
    """Predict the arms of a bag offline.

    Args:
        bag: Bag folder or .mcap file with ``humans/bodies/<id>/arm``.
        library: Known tasks; None: constant velocity.
        config: Settings of the predictor.

    Yields:
        Body id and prediction, arm by arm, after each sample once shoulder and wrist were seen.

    Raises:
        DataError: the bag cannot be read.
    """
    for (body, _), samples in _by_time(BagReader(bag)).items():
        predictor = ReachPredictor(library, config)
        for sample in samples:
            predictor.observe(sample)
            prediction = predictor.predict()
            if prediction is not None:
                yield body, prediction


def compare_bags(
    predicted: str | Path,
    source: str | Path | None = None,
    library: str | Path | None = None,
    config: PredictorConfig | None = None,
) -> list[Comparison]:
    """Hold the predictions in a bag against those made offline.

    Args:
        predicted: Bag with ``humans/bodies/<id>/prediction`` and, as received, ``…/arm``.
        source: Bag that was replayed, whose samples are then used, at its own stamps; None: the
            samples in ``predicted``.
        library: Task library; None: the one that the predictions name, or constant velocity.
        config: Settings of the predictor.

    Returns:
        One an arm that was predicted.

    Raises:
        ConfigError: the predictions come from several libraries.
        DataError: a bag or the library cannot be read, or the two bags hold other samples.
    """
    live = BagReader(predicted)
    found = recorded_predictions(live)
    received = _by_time(live)
    original = received if source is None else _by_time(BagReader(source))
    comparisons = []
    bodies = [body for body, _ in found]
    for arm, item in found.items():
        body = arm[0] if bodies.count(arm[0]) == 1 else " ".join(arm)
        for bag, arms in ((predicted, received), (source, original)):
            if arm not in arms:
                raise DataError(f"{bag} holds no arm of {body}", expected="the predicted bodies")
        shift = stamp_shift(received[arm], original[arm])
        if shift is None:
            raise DataError(
                f"the arm of {body} in {predicted} is not the one in {source}",
                expected="a replay of that bag at speed 1, once, not placed elsewhere",
            )
        predictor = ReachPredictor(_library(item.libraries, library), config)
        stamps = {sample.stamp_ns + shift for sample in original[arm]}
        recorded = sum(sample.stamp_ns in stamps for sample in received[arm])
        shifted = [_earlier(p, shift) for p in item.predictions]
        comparisons.append(compare(body, shifted, original[arm], predictor, recorded))
    return comparisons


def _earlier(prediction: Prediction, by_ns: int) -> Prediction:
    """The same prediction of samples that were stamped earlier; without a reach there is no onset."""
    earlier = replace(prediction, stamp_ns=prediction.stamp_ns - by_ns)
    if prediction.state is ReachState.REACHING:
        return replace(earlier, onset_ns=prediction.onset_ns - by_ns)
    return earlier


def _by_time(bag: BagReader) -> dict[tuple[str, str], list[ArmSample]]:
    """Samples of each arm in the order in which a node takes them."""
    return {
        arm: sorted(samples, key=lambda sample: sample.stamp_ns)
        for arm, samples in arm_samples(bag).items()
    }


def _library(named: tuple[str, ...], given: str | Path | None) -> TaskLibrary | None:
    if len(named) > 1:
        raise ConfigError(
            "the predictions come from several libraries: " + ", ".join(n or "none" for n in named),
            expected="a recording during which none was loaded",
        )
    if given is not None:
        return TaskLibrary.load(given)
    if not named[0]:
        return None
    if not Path(named[0]).is_file():
        raise ConfigError(
            f"the library {named[0]} that the predictions name is not there",
            hint="give its place with --library",
        )
    return TaskLibrary.load(named[0])


def stamp_shift(received: Sequence[ArmSample], original: Sequence[ArmSample]) -> int | None:
    """How much later [ns] the samples were played than they are stamped; None: they are others."""
    at = defaultdict(list)
    for sample in original:
        at[_content(sample)].append(sample.stamp_ns)
    shifts = Counter(
        sample.stamp_ns - stamps[0]
        for sample in received
        if len(stamps := at.get(_content(sample), [])) == 1
    )
    if not shifts:
        return None
    shift, count = shifts.most_common(1)[0]
    # A few samples may be lost; at another speed each has a shift of its own.
    return shift if 2 * count > shifts.total() else None


def _content(sample: ArmSample) -> tuple[str, bytes]:
    return sample.side, sample.keypoints.tobytes()


def compare(
    body: str,
    predictions: Sequence[Prediction],
    samples: Sequence[ArmSample],
    predictor: ReachPredictor,
    recorded: int,
) -> Comparison:
    """Hold predictions against those made offline after the same sample.

    A prediction is found by its stamp, that of the newest sample used. Where samples of which nothing
    could be used came after that one, it is enough to be the same as after any of them.

    Args:
        body: Whose predictions they are, for people.
        predictions: By the clock of the samples.
        samples: By time.
        predictor: Is reset first.
        recorded: See :class:`Comparison`.
    """
    wanted = defaultdict(list)
    for index, prediction in enumerate(predictions):
        wanted[prediction.stamp_ns].append(index)
    gaps: dict[int, tuple[float, ...]] = {}
    predictor.reset()
    for sample in samples:
        predictor.observe(sample)
        offline: dict[bool, Prediction | None] = {}
        for index in wanted.get(predictor.newest_ns, ()):
            if index in gaps and max(gaps[index]) == 0.0:
                continue
            # Whether samples came in time is said by the clock of the day, which is over.
            invalid = predictions[index].state is ReachState.INVALID
            if invalid not in offline:
                late_ns = sample.stamp_ns + _LONG_AFTER_NS
                offline[invalid] = predictor.predict(late_ns if invalid else None)
            gap = difference(predictions[index], offline[invalid])
            if index not in gaps or max(gap) < max(gaps[index]):
                gaps[index] = gap
    wrong = [
        p.stamp_ns
        for index, p in enumerate(predictions)
        if index not in gaps or max(gaps[index]) > TOLERANCE
    ]
    return Comparison(
        body=body,
        samples=len(samples),
        recorded=recorded,
        predictions=len(predictions),
        reaching=sum(p.state is ReachState.REACHING for p in predictions),
        invalid=sum(p.state is ReachState.INVALID for p in predictions),
        strange=len(predictions) - len(gaps),
        different=sum(max(gap) > TOLERANCE for gap in gaps.values()),
        largest=tuple(np.max([*gaps.values(), (0.0,) * len(FIGURES)], axis=0).tolist()),
        first_s=(min(wrong) - samples[0].stamp_ns) * 1e-9 if wrong else None,
    )


def difference(ours: Prediction, other: Prediction | None) -> tuple[float, ...]:
    """Largest differences of the numbers of two predictions, one each of ``FIGURES``.

    All are infinite where anything else than numbers differs, but for the reason: it tells the age of
    samples by the clock.
    """
    if other is None or (
        (ours.state, ours.side, ours.task_names, ours.mean.shape)
        != (other.state, other.side, other.task_names, other.mean.shape)
        or not np.array_equal(ours.times_s, other.times_s)
    ):
        return (float("inf"),) * len(FIGURES)
    times = [
        (ours.onset_ns - other.onset_ns) * 1e-9,
        ours.duration_mean_s - other.duration_mean_s,
        ours.duration_std_s - other.duration_std_s,
    ]
    pairs = (
        ours.mean - other.mean,
        ours.covariance - other.covariance,
        np.array(times),
        ours.task_probabilities - other.task_probabilities,
    )
    return tuple(float(np.abs(pair).max(initial=0.0)) for pair in pairs)
