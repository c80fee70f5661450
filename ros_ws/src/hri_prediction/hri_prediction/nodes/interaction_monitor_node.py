"""Interaction monitor: which case of interaction two tracked people are in, live."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from std_msgs.msg import Header

from hri_prediction.arm.body_id import valid_body_id
from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.ontology.cases import cases
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.features import COUNT
from hri_prediction.ontology.pair import Pair, choose_pair
from hri_prediction.ontology.segment import Segment
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ontology.verdict import Verdict, verdict_on
from hri_prediction.ontology.warm import warm_watch
from hri_prediction.ontology.watch import AGENTS, BACK_NS, SILENT_S, DyadWatch
from hri_prediction.ros.conversions import WORLD, current_sample, flat
from hri_prediction.ros.messages import (
    HumanArm,
    IdsList,
    InteractionCase,
    InteractionFeatures,
    LoadModel,
)
from hri_prediction.ros.node import OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_time
from hri_prediction.ros.tracked import TRACKED, take_list
from hri_prediction.tracked_lists import TrackedLists
from hri_prediction.tracks.segmentation import SegmentationConfig

_ARM_TOPIC = "humans/bodies/{}/arm"
FEATURES_TOPIC, CASE_TOPIC = "interaction/features", "interaction/case"
TELL_NS = NANO // 25
"""Features, and what it looks like so far, are told so often."""
GONE_S = 2.0
"""Others are watched, if there are two, instead of a body that is not seen for so long and that nothing
lists any more: its source has ended."""


@dataclass(frozen=True)
class InteractionMonitorConfig:
    """What the node itself needs to know."""

    classifier: str = parameter(
        "", "Path of a classifier (.npz of train_ontology.py); empty: the one that ships"
    )
    pair: tuple[str, ...] = parameter(
        (), "Ids of the two bodies that are watched; empty: the first two that are tracked"
    )
    side: str = parameter("right", "Which arm of both is watched", choices=("right", "left"))
    period: float = parameter(0.008, "Period of looking", unit="s", low=0.004, high=0.04)
    max_future: float = parameter(
        0.05, "A stamp further ahead of the clock than this is refused", unit="s", low=0.0
    )

    def __post_init__(self) -> None:
        validate(self)
        if self.pair and (len(self.pair) != 2 or len(set(self.pair)) != 2):
            raise ConfigError(f"pair = {list(self.pair)}", expected="two different ids, or none")
        for name in self.pair:
            if not valid_body_id(name):
                raise ConfigError(
                    f"pair = {list(self.pair)}", expected="ids that are part of topics"
                )


class InteractionMonitorNode(HriNode):
    """Watches two bodies and says what they do with each other."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("interaction_monitor", period_s=0.0, **kwargs)
        self._config = declare_config(self, InteractionMonitorConfig)
        watch = declare_config(self, WatchConfig, prefix="watch")
        segmentation = declare_config(self, SegmentationConfig, prefix="segmentation")
        self._path, self._classifier = _load(self._config.classifier)
        self._watch = DyadWatch(watch, segmentation)
        self._lists = TrackedLists()
        self._told_lists = False
        self._pair = Pair(None, "no source has said who is tracked")
        self._gone: frozenset[str] = frozenset()
        self._newest_ns = [0, 0]
        self._since_ns = self._ticked_ns = self._features_ns = 0
        self._seen_ns = np.zeros((len(AGENTS), len(KEYPOINTS)), dtype=np.int64)
        self._unwatched: set[tuple[str, str]] = set()
        self._counts: Counter[str] = Counter()
        self._late_ms: deque[float] = deque(maxlen=500)
        self._next_ns = 0
        self._told_ns = [0, 0]
        warm_watch()
        verdict_on(self._classifier, np.ones(COUNT))
        self._features = self.announce(InteractionFeatures, FEATURES_TOPIC, reliable(1))
        # What movements were is told once: not to be pushed out by what others look like meanwhile, of a
        # reader that is held up for 0.2 s.
        self._cases = self.announce(InteractionCase, CASE_TOPIC, reliable(50))
        self.listen(IdsList, TRACKED, self._on_ids, LISTS)
        self.serve(LoadModel, "~/load_model", self._on_load_model)
        self.set_period(self._config.period)

    # ------------------------------------------------------------------ inputs
    def _on_ids(self, message: IdsList) -> None:
        take_list(self._lists, message, self.tick_ns)
        self._told_lists = True

    def _on_load_model(
        self, request: LoadModel.Request, response: LoadModel.Response
    ) -> LoadModel.Response:
        """What is told from now on is told by another classifier."""
        try:
            self._path, self._classifier = _load(request.path)
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        response.message = f"{len(self._classifier.classes)} cases, of {self._classifier.about}"
        return response

    def _choose(self) -> None:
        """Watch two of those who are tracked."""
        self._told_lists = False
        before, ids = self._pair.bodies, self._lists.ids or ()
        for body in ids:
            if not valid_body_id(body):
                self.fault("bodies", f"body {body!r} is not watched: its name is no part of topics")
        known = [body for body in ids if valid_body_id(body)]
        present = [body for body in known if body not in self._gone]
        enough = len(present) > 1 and not self._config.pair
        self._pair = choose_pair(present if enough else known, self._config.pair, before)
        if self._pair.besides:
            self.fault("bodies", self._pair.besides)
        if self._pair.bodies == before:
            return
        old, new = set(before or ()), set(self._pair.bodies or ())
        for body in sorted(old - new):
            self.ignore(_ARM_TOPIC.format(body))
        self._restart("other bodies are watched now", before)
        for body in sorted(new - old):
            self.listen(HumanArm, _ARM_TOPIC.format(body), self._on_arm, SENSOR)

    def _who_is_gone(self, now_ns: int) -> frozenset[str]:
        """Bodies whose source has ended: nothing says them, and they are not seen."""
        watched = zip(self._pair.bodies or (), self._newest_ns, strict=False)
        silent = {body for body, ns in watched if now_ns - max(ns, self._since_ns) > GONE_S * NANO}
        gone = self._gone | silent
        return gone - self._lists.said if gone else gone

    def _restart(self, reason: str, bodies: tuple[str, str] | None) -> None:
        """Begin anew; movements that were under way, or not told of yet, are refused."""
        if bodies:
            for segment in self._watch.broken_off(reason):
                self._tell_segment(segment, bodies)
        self._watch.restart()
        self._newest_ns = [0, 0]
        self._since_ns, self._features_ns = self.tick_ns, 0
        self._seen_ns.fill(0)

    def _on_arm(self, message: HumanArm) -> None:
        bodies = self._pair.bodies
        if bodies is None or message.body_id not in bodies:
            self.fault("body", f"arm of {message.body_id!r} came on the topic of another body")
            return
        try:
            sample = current_sample(message, self.tick_ns, self._config.max_future)
        except DataError as error:
            self.fault("arm", str(error))
            return
        if sample.side != self._config.side:
            self._unwatched.add((message.body_id, sample.side))
            return
        agent = bodies.index(message.body_id)
        back_ns = self._newest_ns[agent] - sample.stamp_ns
        if back_ns > BACK_NS:
            reason = f"stamps of {message.body_id} went back by {back_ns / NANO:.2f} s"
            self.fault("clock", reason)
            self._restart(reason, bodies)
        self._newest_ns[agent] = max(self._newest_ns[agent], sample.stamp_ns)
        self._seen_ns[agent, sample.valid] = self._newest_ns[agent]
        segments = self._watch.push(agent, sample)
        if self._watch.jump:
            self.fault(f"wrist {message.body_id}", f"{message.body_id}: {self._watch.jump}")
        if self._watch.odd:
            self.fault(f"samples {message.body_id}", f"{message.body_id}: {self._watch.odd}")
        for segment in segments:
            self._tell_segment(segment)

    # ------------------------------------------------------------------ telling
    def _said(
        self,
        agent: int,
        state: int,
        stamp_ns: int,
        reason: str = "",
        bodies: tuple[str, str] | None = None,
    ) -> InteractionCase:
        bodies = bodies or self._pair.bodies
        return InteractionCase(
            header=Header(stamp=to_time(stamp_ns)),
            first=bodies[agent] if bodies else "",
            second=bodies[1 - agent] if bodies else "",
            state=state,
            reason=reason,
            newest_sample=to_time(max(self._newest_ns)),
        )

    def _tell_segment(self, segment: Segment, bodies: tuple[str, str] | None = None) -> None:
        if segment.features is None:
            message = self._said(
                segment.agent, InteractionCase.NONE, segment.end_ns, segment.reason, bodies
            )
            self._counts["refused: " + segment.kind] += 1
        else:
            message = self._said(segment.agent, InteractionCase.COMPLETE, segment.end_ns)
            verdict = verdict_on(self._classifier, segment.features)
            _fill(message, verdict, self._classifier)
            self._counts["movements"] += 1
            self._counts["unlike what was learnt"] += bool(verdict.unlike)
            late_ms = (self.now_ns() - max(self._newest_ns)) / 1e6
            if late_ms < SILENT_S * 1e3:  # else it is told because no more samples come
                self._late_ms.append(late_ms)
        message.onset, message.end = to_time(segment.onset_ns), to_time(segment.end_ns)
        self._cases.publish(message)

    def on_tick(self, now_ns: int) -> None:
        """Tell features, and what movements look like so far, 25 times a second; what ends, each time."""
        if self._ticked_ns - now_ns > BACK_NS:
            # What was heard before has stamps that are still to come: nothing would be old any more.
            reason = f"the clock went back by {(self._ticked_ns - now_ns) / NANO:.2f} s"
            self.fault("clock", reason)
            self._restart(reason, self._pair.bodies)
            self._next_ns = now_ns
        self._ticked_ns = now_ns
        self._lists.look(now_ns)
        gone = self._who_is_gone(now_ns)
        self._told_lists |= gone != self._gone
        self._gone = gone
        if self._told_lists and not self._lists.pending:  # else one who is listed may have left
            self._choose()
        for segment in self._watch.look(now_ns):
            self._tell_segment(segment)
        if now_ns < self._next_ns:
            self._tell_ending(now_ns)
            return
        self._next_ns = max(self._next_ns + TELL_NS, now_ns + TELL_NS // 2)
        reason = self._trouble(now_ns)
        bodies, newest = self._pair.bodies, self._watch.now()
        if reason or bodies is None or newest is None:
            self._cases.publish(self._said(0, InteractionCase.NONE, now_ns, reason))
            return
        stamp_ns, features = newest
        seen = bool(np.isfinite(features).all())
        if seen and stamp_ns != self._features_ns:
            self._features_ns = stamp_ns
            self._features.publish(
                InteractionFeatures(
                    header=Header(stamp=to_time(stamp_ns), frame_id=WORLD),
                    first=bodies[0],
                    second=bodies[1],
                    side=self._config.side,
                    features=features,
                )
            )
        moving = [agent for agent in AGENTS if self._watch.moving(agent)]
        self._tell_running(moving)
        if not moving:
            words = "both are at rest" if seen else "not all of both arms is seen"
            self._cases.publish(self._said(0, InteractionCase.NONE, stamp_ns, words))

    def _tell_ending(self, now_ns: int) -> None:
        """Tell what may soon be over as soon as more is known: its end is not to wait for its turn."""
        ending = [agent for agent in AGENTS if self._watch.ending(agent)]
        if ending and not self._trouble(now_ns):
            self._tell_running(ending)

    def _tell_running(self, agents: Sequence[int]) -> None:
        """Tell what movements look like so far, once with each newest sample of both."""
        newest_ns = min(self._newest_ns)
        for agent in agents:
            if self._told_ns[agent] == newest_ns:
                continue
            so_far = self._watch.running(agent)
            if so_far is not None:
                self._told_ns[agent] = newest_ns
                stamp_ns, features = so_far
                message = self._said(agent, InteractionCase.RUNNING, stamp_ns)
                message.onset = to_time(self._watch.onset_ns(agent))
                _fill(message, verdict_on(self._classifier, features), self._classifier)
                self._cases.publish(message)

    def _trouble(self, now_ns: int) -> str:
        """Why nothing can be said; empty when something can."""
        bodies = self._pair.bodies
        if bodies is None:
            return self._pair.reason
        for agent, body in enumerate(bodies):
            newest_ns = self._newest_ns[agent]
            other = {"right": "left", "left": "right"}[self._config.side]
            if not newest_ns:
                seen = f"; its {other} arm is" if (body, other) in self._unwatched else ""
                return f"no {self._config.side} arm of {body} has been seen yet{seen}"
            if now_ns - newest_ns > SILENT_S * NANO:
                return f"{body} was last seen {(now_ns - newest_ns) / NANO:.1f} s ago"
            if slow := self._watch.trouble(agent):
                return f"{body}: {slow}"
            ages = now_ns - self._seen_ns[agent]
            lost = [index for index in range(len(KEYPOINTS)) if ages[index] > SILENT_S * NANO]
            if lost:
                names = " and ".join(KEYPOINTS[index].replace("_", " ") for index in lost)
                verb = "is" if len(lost) == 1 else "are"
                return f"the {self._config.side} {names} of {body} {verb} not seen"
        return ""

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Whom it watches, and what came of movements."""
        figures: dict[str, Any] = {"classifier": self._path, **self._counts}
        if self._pair.besides:
            figures["besides"] = self._pair.besides
        if self._late_ms:
            for share in (50, 99):
                figures[f"latency_ms_p{share}"] = f"{np.percentile(self._late_ms, share):.1f}"
        reason = self._trouble(self.now_ns())
        if reason:
            return WARN, reason, figures
        assert self._pair.bodies is not None
        return OK, "watching " + " and ".join(self._pair.bodies), figures


def _load(given: str) -> tuple[str, InteractionClassifier]:
    """A classifier of cases, as the message has them, and its file.

    Args:
        given: The file; empty: of the one that ships.

    Raises:
        ConfigError: when it is one of something else.
        DataError: when it cannot be read.
    """
    path = given or str(SHIPPED)
    classifier = InteractionClassifier.load(path)
    if not set(classifier.classes.tolist()) <= {case.number for case in cases()}:
        raise ConfigError(
            f"classifier {path} knows the classes {classifier.classes.tolist()}",
            expected="cases from 1 to 20",
        )
    return path, classifier


def _fill(message: InteractionCase, verdict: Verdict, classifier: InteractionClassifier) -> None:
    message.reason = verdict.unlike
    message.number, message.probability = verdict.number, verdict.probability
    message.group, message.group_probability = verdict.group, verdict.group_probability
    message.cases = classifier.classes.tolist()
    message.probabilities = flat(verdict.probabilities)


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    return run_node(InteractionMonitorNode, args)
