"""Two arms watched: movement segments, each with its mean features, as samples come; also used offline.

Both arms are smoothed at the same instants, whole multiples of a step (:mod:`.smoothing`), and the features
of these taken (:mod:`.features`). Segments are cut on the wrist of each of the two in turn, by the same
code that the predictor cuts reaches with; the one whose wrist it is counts as agent 1 then.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.features import COUNT, EXCHANGED, fill_features
from hri_prediction.ontology.jumps import SPEED_S, jumped
from hri_prediction.ontology.segment import Segment
from hri_prediction.ontology.smoothing import SmoothedArm
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.input_check import InputCheck
from hri_prediction.tracks.rate import too_slow
from hri_prediction.tracks.segmentation import ROUNDING_S, ReachSegmenter, SegmentationConfig
from hri_prediction.tracks.track import ArmSample

FloatArray = NDArray[np.float64]

AGENTS = (0, 1)
_WRIST = 2
BACK_NS = 200_000_000
"""Stamps that go back by more are those of another take: nothing goes on [ns]."""
SILENT_S = 0.5
"""Of whom no samples come for so long, no movement is waited for any longer [s]."""
_NANO = 1e-9
_LOST = "the arm was lost sight of"
_JUMP = "jump"
_ODD = (_JUMP, "markers swapped", "implausible length")
"""What is told of keypoints that do not count, by its begin."""


@dataclass
class _Agent:
    """What is known of one of the two."""

    segmenter: ReachSegmenter
    arm: SmoothedArm
    check: InputCheck
    onset_s: float | None = None
    wrists: deque[tuple[float, FloatArray]] = field(default_factory=deque)
    waiting: list[tuple[float, float]] = field(default_factory=list)


class DyadWatch:
    """Follows two arms.

    Args:
        config: Of the features.
        segmentation: Thresholds of the segments; by default those of the predictor.

    Attributes:
        jump: What is wrong with the newest sample, whose wrist is another one's or elsewhere; else empty.
        odd: Why keypoints of the newest sample do not count although they are seen; else empty.
    """

    def __init__(
        self, config: WatchConfig | None = None, segmentation: SegmentationConfig | None = None
    ) -> None:
        self.config = config or WatchConfig()
        self.segmentation = segmentation or SegmentationConfig()
        self._checks = PredictorConfig()
        self._rows = math.ceil(self.config.longest / self.config.step) + 1
        self._features = np.empty((self._rows, COUNT))
        self._first = np.empty((4, 3))
        self.restart()

    def restart(self) -> None:
        """Forget everything."""
        self._features.fill(np.nan)
        self._origin_ns: int | None = None
        self._next = 0
        self.jump = self.odd = ""
        self._agents = tuple(
            _Agent(
                ReachSegmenter(self.segmentation),
                SmoothedArm(self.config.smoothing, self.config.max_gap),
                InputCheck(self._checks),
            )
            for _ in AGENTS
        )

    # ------------------------------------------------------------------ taking
    def push(self, agent: int, sample: ArmSample) -> list[Segment]:
        """Take a sample of one of the two.

        Args:
            agent: 0 or 1.
            sample: Later than the one before of the same agent; others are left out.

        Returns:
            The segments that are complete with it, in most cases none.
        """
        if self._origin_ns is None:
            # A whole number of steps, so that instants are the same whenever watching began.
            step_ns = round(self.config.step / _NANO)
            self._origin_ns = sample.stamp_ns // step_ns * step_ns
        own = self._agents[agent]
        self.jump = ""
        time_s = (sample.stamp_ns - self._origin_ns) * _NANO
        if time_s <= own.arm.newest_s or time_s < 0.0:
            return []
        found = self.look(sample.stamp_ns)
        keypoints = self._checked(own, sample)
        if np.isfinite(keypoints[_WRIST]).all():
            found += self._wrist(agent, time_s, keypoints[_WRIST])
        else:
            found += self._unseen(agent, time_s)
        own.arm.push(time_s, keypoints)
        return found + self._advance()

    def _checked(self, own: _Agent, sample: ArmSample) -> FloatArray:
        """Keypoints (4, 3), NaN where one cannot be used; by the checks that the predictor has."""
        verdict = own.check.check(sample)
        self.odd = verdict.reason if verdict.reason.startswith(_ODD) else ""
        usable = verdict.usable.copy()
        if self.odd.startswith(_JUMP):
            # Whose wrist it is now is asked below, of both.
            usable[_WRIST] = sample.valid[_WRIST]
        return np.where(usable[:, None], sample.keypoints, np.nan)

    def look(self, now_ns: int) -> list[Segment]:
        """The segments that are complete because no samples come any more; see :meth:`finish`.

        Args:
            now_ns: Time now, on the clock of the samples [ns].
        """
        if self._origin_ns is None:
            return []
        heard_s = (now_ns - self._origin_ns) * _NANO - SILENT_S - ROUNDING_S
        return [
            segment
            for agent, own in enumerate(self._agents)
            if own.arm.newest_s < heard_s
            for segment in self._end(agent)
        ]

    def _unseen(self, agent: int, time_s: float) -> list[Segment]:
        """The wrist is not seen: nobody knows whether a movement goes on when it is for too long."""
        own = self._agents[agent]
        if own.onset_s is None or not own.wrists:
            return []
        last_s = own.wrists[-1][0]
        if time_s - last_s <= self.segmentation.max_gap + ROUNDING_S:
            return []
        onset_s, own.onset_s = own.onset_s, None
        return [self._none(agent, onset_s, last_s, _LOST)]

    def _wrist(self, agent: int, time_s: float, wrist: FloatArray) -> list[Segment]:
        own = self._agents[agent]
        gaps = self.segmentation.max_gap + ROUNDING_S
        way = jumped(own.wrists, self._agents[1 - agent].wrists, time_s, wrist, self.config, gaps)
        if way > 0.0:
            return self._jumped(agent, time_s, wrist, way)
        while own.wrists and own.wrists[0][0] < time_s - SPEED_S:
            own.wrists.popleft()
        own.wrists.append((time_s, wrist.copy()))
        event = own.segmenter.push(time_s, wrist)
        if event is None:
            return []
        found = []
        if own.onset_s is not None:
            if event.kind == "lost":
                found = [self._none(agent, own.onset_s, event.time_s, _LOST)]
            else:
                found = self._over(agent, own.onset_s, event.time_s)
        own.onset_s = event.time_s if event.kind == "onset" else None
        return found

    def _jumped(self, agent: int, time_s: float, wrist: FloatArray, way: float) -> list[Segment]:
        """A wrist is another one now: whatever is under way has distances to both in it."""
        own, partner = self._agents[agent], self._agents[1 - agent]
        last_s = own.wrists[-1][0]
        self.jump = f"the wrist jumped by {way:.2f} m"
        found = []
        for who, each, words in (
            (agent, own, self.jump),
            (1 - agent, partner, f"the other one's wrist jumped by {way:.2f} m"),
        ):
            onset_s, each.onset_s = each.onset_s, None
            if onset_s is not None:
                found.append(self._none(who, onset_s, last_s, words))
        own.segmenter.reset()
        own.segmenter.push(time_s, wrist)
        own.wrists.clear()
        own.wrists.append((time_s, wrist.copy()))
        # No parabola through places of both, and no lengths of both.
        own.arm.forget()
        own.check.reset()
        return found

    def _over(self, agent: int, onset_s: float, end_s: float) -> list[Segment]:
        """A segment has ended; its features come when the arms are known until then."""
        seconds = end_s - onset_s
        if slow := self.trouble(0) or self.trouble(1):
            return [self._none(agent, onset_s, end_s, slow)]
        if seconds < self.segmentation.min_duration:
            return [self._none(agent, onset_s, end_s, f"too short: {seconds:.2f} s")]
        if seconds > self.config.longest:
            return [self._none(agent, onset_s, end_s, f"too long: {seconds:.1f} s")]
        self._agents[agent].waiting.append((onset_s, end_s))
        return []

    # ------------------------------------------------------------------ features
    def _advance(self) -> list[Segment]:
        """Take the features of all instants that are known of both, or not to be known any more."""
        config = self.config
        newest = [own.arm.newest_s for own in self._agents]
        late_s = max(own.arm.half_s for own in self._agents)
        known_s = min(newest) - late_s
        # Who is not seen for longer than gaps are filled is not waited for.
        given_up_s = max(newest) - 2.0 * config.max_gap - late_s
        until = math.floor((max(known_s, given_up_s) + ROUNDING_S) / config.step)
        if until - self._next >= self._rows:
            self._features.fill(np.nan)
            self._next = until - self._rows + 1
        for index in range(self._next, until + 1):
            self._fill(index, self._features[index % self._rows])
        self._next = max(self._next, until + 1)
        return self._complete()

    def _fill(self, index: int, row: FloatArray) -> None:
        """Take the features of an instant."""
        self._first[:] = self._agents[0].arm.at(index * self.config.step)
        fill_features(self._first, self._agents[1].arm.at(index * self.config.step), row)

    def _reached(self) -> int:
        """The last instant that samples of both have reached, be it too new to be smoothed as asked for."""
        newest_s = min(own.arm.newest_s for own in self._agents)
        return self._index(newest_s) if newest_s >= 0.0 else -1

    def _late_rows(self, agent: int, onset_s: float, last: int) -> FloatArray:
        """Features of instants that are not kept yet, by what samples there are."""
        first = max(self._first_index(onset_s), self._next)
        rows = np.empty((max(last + 1 - first, 0), COUNT))
        for index, row in enumerate(rows, start=first):
            self._fill(index, row)
        return rows[:, EXCHANGED] if agent else rows

    def _complete(self) -> list[Segment]:
        found = []
        for agent, own in enumerate(self._agents):
            while own.waiting and self._index(own.waiting[0][1]) < self._next:
                found.append(self._segment(agent, *own.waiting.pop(0)))
        return found

    def _index(self, time_s: float) -> int:
        """The last instant that is not later."""
        return math.floor((time_s + ROUNDING_S) / self.config.step)

    def _first_index(self, time_s: float) -> int:
        """The first instant that is not earlier."""
        return math.ceil((time_s - ROUNDING_S) / self.config.step)

    def _rows_of(self, agent: int, onset_s: float, last: int) -> FloatArray:
        first = max(self._first_index(onset_s), self._next - self._rows, 0)
        rows = self._features[np.arange(first, last + 1) % self._rows]
        return rows[:, EXCHANGED] if agent else rows

    def _segment(self, agent: int, onset_s: float, end_s: float) -> Segment:
        last = self._index(end_s)
        rows = self._rows_of(agent, onset_s, min(last, self._next - 1))
        seen = rows[np.isfinite(rows).all(axis=1)]
        count = max(round((end_s - onset_s) / self.config.step), 1)
        if len(seen) < max(self.config.least_seen * count, 1):
            share = 100.0 * len(seen) / count
            return self._none(agent, onset_s, end_s, f"both arms were seen for {share:.0f} % of it")
        return Segment(agent, self._ns(onset_s), self._ns(end_s), seen.mean(axis=0))

    def _none(self, agent: int, onset_s: float, end_s: float, reason: str) -> Segment:
        return Segment(agent, self._ns(onset_s), self._ns(end_s), None, reason)

    def _ns(self, time_s: float) -> int:
        assert self._origin_ns is not None
        return self._origin_ns + round(time_s / _NANO)

    # ------------------------------------------------------------------ asking
    def moving(self, agent: int) -> bool:
        """Whether an agent's segment is under way."""
        return self._agents[agent].onset_s is not None

    def broken_off(self, reason: str) -> list[Segment]:
        """All movements that are not told of yet, under way or over, where nothing goes on.

        Args:
            reason: Why.
        """
        now_s = max(own.arm.newest_s for own in self._agents)
        found = []
        for agent, own in enumerate(self._agents):
            found += [self._none(agent, *ends, reason) for ends in own.waiting]
            if own.onset_s is not None:
                found.append(self._none(agent, own.onset_s, now_s, reason))
        return found

    def ending(self, agent: int) -> bool:
        """Whether a segment under way may soon be over: its wrist is slowing down."""
        own = self._agents[agent]
        return own.onset_s is not None and own.segmenter.slowing

    def onset_ns(self, agent: int) -> int:
        """When the segment that is under way began [ns]; 0 without one."""
        onset_s = self._agents[agent].onset_s
        return 0 if onset_s is None else self._ns(onset_s)

    def running(self, agent: int) -> tuple[int, FloatArray] | None:
        """What is known so far of the segment that is under way; none without one.

        The last instants are smoothed by what samples there are: what it looks like does not wait for those
        that smoothing asks for, which the features of a segment that is over have. A wrist that is slow may
        be at rest already, which would be no part of the segment: from there on nothing counts.

        Returns:
            The last instant at which both arms are seen [ns], and mean features until then (25,) [m].
        """
        onset_s = self._agents[agent].onset_s
        if onset_s is None:
            return None
        rows = np.concatenate(
            (
                self._rows_of(agent, onset_s, self._next - 1),
                self._late_rows(agent, onset_s, self._reached()),
            )
        )
        seen = np.flatnonzero(np.isfinite(rows).all(axis=1))
        if not len(seen):
            return None
        first = max(self._next - 1, self._reached()) - (len(rows) - 1)
        at_s = (first + seen) * self.config.step
        moved = at_s <= self._agents[agent].segmenter.rest_s + ROUNDING_S
        if moved.any():
            return self._ns(float(at_s[-1])), rows[seen[moved]].mean(axis=0)
        return self._ns(float(at_s[-1])), rows[seen].mean(axis=0)

    def trouble(self, agent: int) -> str:
        """Why nothing is found in samples that come as those of an agent do; empty where something is."""
        return too_slow(self._agents[agent].segmenter.period_s)

    def now(self) -> tuple[int, FloatArray] | None:
        """The newest features (25,) [m], agent 0 as agent 1, and their time [ns]; none before the first."""
        if self._origin_ns is None or not self._next:
            return None
        index = self._next - 1
        return self._ns(index * self.config.step), self._features[index % self._rows].copy()

    def finish(self) -> list[Segment]:
        """What is still to come when no more samples do.

        A recording may stop the moment a hand does: a wrist that was as slow as at rest has ended its
        segment; of one that was not, nobody knows how it went on.
        """
        return [segment for agent in AGENTS for segment in self._end(agent)]

    def _end(self, agent: int) -> list[Segment]:
        """What is still to come of one of the two of whom no more samples do."""
        own = self._agents[agent]
        found = []
        if own.onset_s is not None:
            onset_s, own.onset_s = own.onset_s, None
            if own.segmenter.speed < self.segmentation.onset_speed:
                found = self._over(agent, onset_s, own.arm.newest_s - 0.5 * own.segmenter.window_s)
            else:
                found = [self._none(agent, onset_s, own.wrists[-1][0], _LOST)]
        waiting, own.waiting = own.waiting, []
        return found + [self._segment(agent, *ends) for ends in waiting]
