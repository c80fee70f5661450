"""What follows the bodies that are tracked: a predictor for each arm, a topic for each body."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.facing import FacingWatch
from hri_prediction.prediction.input_check import TOLD
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.prediction.output import Prediction, ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.ros.node import CountedPublisher
from hri_prediction.tracks.track import ArmSample

if TYPE_CHECKING:  # it takes a while to load, and only who learns people needs it
    from hri_prediction.hybrid.watch import ArmWatch


class FollowedArm:
    """One arm of a body.

    Args:
        library: Known tasks, or none.
        config: Of the predictor.
        watch: Sees what the hybrid loop is to know of the arm; none: it learns nothing.

    Attributes:
        predictor: Has seen all samples of this arm.
        prediction: The newest one; none until there is any.
        turned: Why the library's reaches will not be recognised; empty unless the arm is turned.
    """

    def __init__(
        self,
        library: TaskLibrary | None,
        config: PredictorConfig,
        watch: ArmWatch | None = None,
    ) -> None:
        self.watch = watch
        self.predictor = ReachPredictor(library, config)
        self.prediction: Prediction | None = None
        self.turned = ""
        self._facing = FacingWatch(library) if library is not None else None
        self._told: dict[str, int] = {}
        # What the newest sample took, until it is predicted from.
        self._observed_ms: float | None = None

    def observe(self, sample: ArmSample) -> str:
        """Take a sample; once, a line that says that the arm is turned, else nothing."""
        begin = time.perf_counter()
        self.predictor.observe(sample)
        if self.watch is not None:
            self.watch.observe(sample, self.predictor)
        self._observed_ms = 1e3 * (time.perf_counter() - begin)
        turned = self._facing.observe([sample]) if self._facing is not None else ""
        self.turned = turned or self.turned
        return turned

    def news(self) -> list[tuple[str, str]]:
        """Faults of samples that came since this was asked last: a short name, and a line for people."""
        counts = {name: self.predictor.counters.get(name, 0) for name in TOLD}
        found = [
            (name, f"{words}, {counts[name]} so far")
            for name, words in TOLD.items()
            if counts[name] > self._told.get(name, 0)
        ]
        self._told = counts
        return found

    def predict(self, now_ns: int) -> float | None:
        """Predict anew.

        Returns:
            What the newest sample and the prediction from it took, while the arm reaches [ms]; none
            without a new sample, or a reach.
        """
        begin = time.perf_counter()
        self.prediction = self.predictor.predict(now_ns)
        spent_ms = 1e3 * (time.perf_counter() - begin)
        fresh, self._observed_ms = self._observed_ms, None
        if fresh is None or self.prediction is None:
            return None
        return fresh + spent_ms if self.prediction.state is ReachState.REACHING else None


class FollowedBody:
    """The arms of a body that were ever seen: one, or both.

    Args:
        body_id: Its name.
        publisher: Takes the predictions of both arms.

    Attributes:
        arms: By side.
    """

    def __init__(self, body_id: str, publisher: CountedPublisher) -> None:
        self.body_id = body_id
        self.publisher = publisher
        self.arms: dict[str, FollowedArm] = {}

    def named_arms(self) -> Iterator[tuple[str, FollowedArm]]:
        """Each arm with its name for people: the body's, and the side where there are two."""
        for side, arm in sorted(self.arms.items()):
            yield self.name_of(side), arm

    def name_of(self, side: str) -> str:
        """Name of an arm for people."""
        return f"{self.body_id} {side}" if len(self.arms) > 1 else self.body_id
