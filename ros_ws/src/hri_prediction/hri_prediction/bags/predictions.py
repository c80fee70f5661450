"""Predictions in bags: which topics hold them, and what they say."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError
from hri_prediction.prediction.output import Prediction, ReachState

PREDICTION_TYPE = "hri_msgs/msg/HumanPrediction"
PREDICTED = re.compile(r"^(?:.*/)?humans/bodies/(?P<body>[^/]+)/prediction$")
"""Topic of the predictions of a body's arms."""


@dataclass(frozen=True)
class RecordedPredictions:
    """What was predicted of one arm.

    Attributes:
        predictions: In the order of receipt.
        libraries: Names of the task libraries that they come from, in the order of their use; empty
            for constant velocity.
    """

    predictions: tuple[Prediction, ...]
    libraries: tuple[str, ...]


def recorded_predictions(bag: BagReader) -> dict[tuple[str, str], RecordedPredictions]:
    """The predictions in a bag, by body id and side.

    Raises:
        DataError: the bag is damaged, or holds no prediction.
    """
    topics = {
        name: match["body"]
        for name, info in bag.topics.items()
        if info.type == PREDICTION_TYPE and (match := PREDICTED.match(name))
    }
    found: dict[tuple[str, str], list[Prediction]] = {}
    libraries: dict[tuple[str, str], dict[str, None]] = {}
    for message in bag.messages(topics) if topics else ():
        try:
            decoded = message.decode()
            prediction = prediction_of(decoded)
        except DataError as error:
            raise DataError(
                f"{bag.path}: {error.problem}", expected=error.expected, hint=error.hint
            ) from error
        arm = topics[message.topic], prediction.side
        found.setdefault(arm, []).append(prediction)
        libraries.setdefault(arm, {})[decoded.library] = None
    if not found:
        raise DataError(
            f"{bag.path} holds no prediction",
            expected=f"messages of type {PREDICTION_TYPE}",
            hint="the predictor must run, and a source of motion capture, while it is recorded",
        )
    return {
        arm: RecordedPredictions(tuple(items), tuple(libraries[arm]))
        for arm, items in sorted(found.items())
    }


def prediction_of(message: Any) -> Prediction:
    """Prediction of a HumanPrediction message, whatever its frame.

    Raises:
        DataError: its arrays are not of the sizes that belong together, or its state is unknown.
    """
    count, tasks = len(message.times), len(message.tasks)
    sizes = (len(message.mean), len(message.covariance), len(message.task_probabilities))
    if sizes != (12 * count, 36 * count, tasks) or message.state not in list(ReachState):
        raise DataError(
            f"a prediction of {message.body_id!r} has {count} times, {sizes[0]} means, {sizes[1]} "
            f"covariances, {tasks} tasks with {sizes[2]} probabilities, and the state "
            f"{message.state}",
            expected="12 means and 36 covariances a time, a probability a task, a state from 0 to 2",
        )
    return Prediction(
        stamp_ns=_nanoseconds(message.header.stamp),
        state=ReachState(message.state),
        reason=message.reason,
        side=message.side,
        times_s=np.array(message.times, dtype=float),
        mean=np.array(message.mean, dtype=float).reshape(count, 4, 3),
        covariance=np.array(message.covariance, dtype=float).reshape(count, 4, 3, 3),
        onset_ns=_nanoseconds(message.onset),
        duration_mean_s=message.duration_mean,
        duration_std_s=message.duration_sd,
        task_names=tuple(message.tasks),
        task_probabilities=np.array(message.task_probabilities, dtype=float),
    )


def _nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)
