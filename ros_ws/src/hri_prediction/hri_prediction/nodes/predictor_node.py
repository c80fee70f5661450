"""Predictor node: where each tracked arm will be, mean and covariance over time."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from visualization_msgs.msg import MarkerArray

from hri_prediction.arm.body_id import valid_body_id
from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError, HriError
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.prediction.live_scores import LiveFigures
from hri_prediction.prediction.output import ReachState
from hri_prediction.ros.conversions import (
    check_finite,
    current_sample,
    message_from_prediction,
)
from hri_prediction.ros.following import FollowedArm, FollowedBody
from hri_prediction.ros.markers import arm_markers, prediction_markers
from hri_prediction.ros.messages import HumanArm, HumanPrediction, IdsList, LoadModel
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS, PREDICTIONS, SENSOR, reliable
from hri_prediction.ros.time import NANO
from hri_prediction.ros.tracked import TRACKED, take_list
from hri_prediction.tracked_lists import TrackedLists
from hri_prediction.warm import warm_kernels

if TYPE_CHECKING:
    from hri_prediction.ros.learning import Learning

MARKER_PERIOD_NS = NANO // 10
_ARM_TOPIC = "humans/bodies/{}/arm"


@dataclass(frozen=True)
class PredictorNodeConfig:
    """What the node itself needs to know."""

    library: str = parameter(
        "", "Path of a task library (.npz of train_promp.py); empty: constant-velocity prediction"
    )
    period: float = parameter(0.02, "Period of the predictions", unit="s", low=0.004, high=0.04)
    max_future: float = parameter(
        0.05, "A stamp further ahead of the clock than this is refused", unit="s", low=0.0
    )
    max_bodies: int = parameter(4, "Bodies that are followed at the same time", low=1, high=16)
    hybrid: bool = parameter(
        False,
        "Whether people are learnt: optimal control guesses their reaches to the targets, their own "
        "reaches mend the guess",
    )
    target_names: tuple[str, ...] = parameter((), "Names of the targets of people (hybrid)")
    target_positions: tuple[float, ...] = parameter(
        (), "x, y, z of each, where the tip of the hand ends, in the frame of the bodies", unit="m"
    )
    facing: str = parameter(
        "auto",
        "Where people face, in degrees from x towards y; auto: the quarter turn nearest to the targets "
        "(hybrid)",
    )
    weights: str = parameter(
        "",
        "Path of a process of weights (.json of fit_weights.py); empty: the one that ships (hybrid)",
    )
    people_folder: str = parameter(
        "", "Folder in which people are kept; empty: they are forgotten at the end (hybrid)"
    )
    people: tuple[str, ...] = parameter(
        (), "Who bodies are, as BODY=NAME; others are called as their body (hybrid)"
    )

    def __post_init__(self) -> None:
        validate(self)


class PredictorNode(HriNode):
    """Follows every tracked body and predicts each of its arms that is seen."""

    def __init__(self, **kwargs: Any) -> None:
        # The period is a parameter, so the timer can only be made after the declaration.
        super().__init__("predictor", period_s=0.0, **kwargs)
        self._config = declare_config(self, PredictorNodeConfig)
        self._prediction_config = declare_config(self, PredictorConfig)
        self._library = self._load(self._config.library) if self._config.library else None
        self._library_name = self._config.library
        self._bodies: dict[str, FollowedBody] = {}
        self._lists = TrackedLists()
        self._followed_ids: tuple[str, ...] = ()
        self._compute_ms: deque[float] = deque(maxlen=500)
        self._next_markers_ns = 0
        guess = declare_config(self, HybridConfig, prefix="guess")
        self._learning = self._learn(guess) if self._config.hybrid else None
        self._without = "none (hybrid)" if self._learning else "none (constant velocity)"
        warm_kernels()
        self._markers = self.announce(MarkerArray, "humans/markers", reliable(1))
        self.listen(IdsList, TRACKED, self._on_ids, LISTS)
        self.serve(LoadModel, "~/load_model", self._on_load_model)
        self.set_period(self._config.period)

    def _learn(self, guess: HybridConfig) -> Learning:
        """What learns people."""
        # Here, as it takes half a second to load, and a predictor with a library needs none of it.
        from hri_prediction.ros.learning import Learning, targets_of

        self.get_logger().info("starting what learns people; the first time it is compiled")
        return Learning(
            targets_of(self._config.target_names, self._config.target_positions),
            self._prediction_config,
            guess,
            facing=self._config.facing,
            weights=self._config.weights,
            folder=self._config.people_folder,
            people=self._config.people,
            at_once=self.lockstep,
        )

    def _load(self, path: str) -> TaskLibrary:
        library = TaskLibrary.load(path)
        self.get_logger().info(f"{path}: {len(library.tasks)} tasks, {library.placed}")
        return library

    def _arm(self, side: str) -> FollowedArm:
        """What follows an arm, from now on."""
        watch = self._learning.watch(side) if self._learning is not None else None
        return FollowedArm(self._library, self._prediction_config, watch)

    # ------------------------------------------------------------------ inputs
    def _on_ids(self, message: IdsList) -> None:
        take_list(self._lists, message, self.tick_ns)
        self._follow()

    def _follow(self) -> None:
        """Follow those who are tracked, and nobody else."""
        self._followed_ids = ids = self._lists.ids or ()
        for body_id in [known for known in self._bodies if known not in ids]:
            # Trackers give a new id to whoever reappears: what is over must make room.
            self.ignore(_ARM_TOPIC.format(body_id))
            self.withdraw(self._bodies.pop(body_id).publisher)
        for body_id in ids:
            if body_id in self._bodies:
                continue
            if not valid_body_id(body_id):
                self.fault(
                    "bodies", f"body {body_id!r} is not followed: its name is no part of topics"
                )
                continue
            if len(self._bodies) >= self._config.max_bodies:
                if not self._lists.pending:  # else there may be room soon
                    why = f"max_bodies = {len(self._bodies)}"
                    self.fault("bodies", f"body {body_id!r} is not followed: {why}")
                continue
            publisher = self.announce(
                HumanPrediction, f"humans/bodies/{body_id}/prediction", PREDICTIONS
            )
            self._bodies[body_id] = FollowedBody(body_id, publisher)
            self.listen(HumanArm, _ARM_TOPIC.format(body_id), self._on_arm, SENSOR)

    def _on_arm(self, message: HumanArm) -> None:
        body = self._bodies.get(message.body_id)
        if body is None:
            self.fault("body", f"arm of {message.body_id!r} came on the topic of another body")
            return
        try:
            sample = current_sample(message, self.tick_ns, self._config.max_future)
        except DataError as error:
            self.fault("arm", str(error))
            return
        if not sample.valid.all():
            try:
                check_finite(message)
            except DataError as error:
                self.fault("arm", str(error))
        if sample.side not in body.arms:
            body.arms[sample.side] = self._arm(sample.side)
        if turned := body.arms[sample.side].observe(sample):
            self.get_logger().warning(f"{body.name_of(sample.side)}: {turned}")

    def _on_load_model(
        self, request: LoadModel.Request, response: LoadModel.Response
    ) -> LoadModel.Response:
        try:
            self._library = self._load(request.path)
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        self._library_name = request.path
        for body in self._bodies.values():
            body.arms = {side: self._arm(side) for side in body.arms}
        if self._learning is not None:
            self._learning.anew()
        response.success = True
        names = ", ".join(task.name for task in self._library.tasks)
        response.message = f"{names}; {self._library.placed}"
        return response

    # ------------------------------------------------------------------ work
    def on_tick(self, now_ns: int) -> None:
        """Predict every tracked arm that was ever seen."""
        self._lists.look(now_ns)
        if (self._lists.ids or ()) != self._followed_ids:
            self._follow()
        for body in self._bodies.values():
            for name, arm in body.named_arms():
                for kind, text in arm.news():
                    self.fault(f"samples {name} {kind}", f"{name}: {text}")
                spent_ms = arm.predict(now_ns)
                if spent_ms is not None:
                    self._compute_ms.append(spent_ms)
                if arm.prediction is None:
                    continue
                if arm.prediction.state is ReachState.INVALID:
                    self.fault(f"invalid {name}", f"{name} invalid: {arm.prediction.reason}")
                body.publisher.publish(
                    message_from_prediction(arm.prediction, body.body_id, self._library_name)
                )
        if self._learning is not None:
            for about, text in self._learning.exchange(self._bodies, self._library):
                self.fault(f"hybrid {about}", f"hybrid: {text}")
        if now_ns >= self._next_markers_ns or self._next_markers_ns - now_ns > NANO:
            self._next_markers_ns = now_ns + MARKER_PERIOD_NS
            self._publish_markers()

    def _publish_markers(self) -> None:
        markers = MarkerArray()
        for body in self._bodies.values():
            for name, arm in body.named_arms():
                if arm.prediction is not None:
                    markers.markers += arm_markers(arm.prediction, name)
                    markers.markers += prediction_markers(arm.prediction, name)
        if markers.markers:
            self._markers.publish(markers)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """State of every arm, counts of refused samples, how good predictions were and how fast."""
        figures: dict[str, Any] = {"library": self._library_name or self._without}
        level, words = OK, []
        for body in self._bodies.values():
            if not body.arms:
                level = max(level, WARN)
                words.append(f"{body.body_id} not seen yet")
            for name, arm in body.named_arms():
                if arm.prediction is None:
                    level, state = max(level, WARN), "not seen yet"
                elif arm.prediction.state is ReachState.INVALID:
                    level, state = ERROR, f"invalid: {arm.prediction.reason}"
                else:
                    state = arm.prediction.state.name.lower()
                words.append(f"{name} {state}")
                if arm.turned:
                    figures[f"{name} turned"] = arm.turned
                for counter, count in arm.predictor.counters.items():
                    figures[f"{name} {counter}"] = count
                figures |= _figures(name, arm.predictor.live_figures())
        if self._learning is not None:
            figures |= self._learning.figures
        if self._compute_ms:
            for share in (50, 99):
                figures[f"latency_ms_p{share}"] = f"{np.percentile(self._compute_ms, share):.3f}"
        if not self._bodies:
            return WARN, "no body is tracked", figures
        return level, "; ".join(words), figures

    def close(self) -> None:
        """End the process that learns."""
        if self._learning is not None:
            self._learning.close()


def _figures(name: str, found: dict[float, LiveFigures]) -> dict[str, Any]:
    """The figures of an arm by the names that they have in the evaluation offline."""
    named: dict[str, Any] = {}
    for horizon_s, at in found.items():
        key = f"{name} {horizon_s:g} s"
        named[f"{key} n"] = at.n
        named[f"{key} error_median_m"] = f"{at.error_median_m:.4f}"
        named[f"{key} error_mean_m"] = f"{at.error_mean_m:.4f}"
        named[f"{key} coverage50"] = f"{at.coverage50:.3f}"
        named[f"{key} coverage95"] = f"{at.coverage95:.3f}"
        named[f"{key} nll"] = f"{at.nll:.2f}"
    return named


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(PredictorNode, args)
