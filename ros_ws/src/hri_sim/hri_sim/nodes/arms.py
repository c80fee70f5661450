"""True arms over time, as the simulator hears them."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.tracks.track import ArmSample
from hri_sim.scenario.schema import Scenario

FloatArray = NDArray[np.float64]


class ArmTimeline:
    """The latest poses of one arm; interpolates between them, holds the last one.

    Args:
        length: How many poses to keep.
    """

    def __init__(self, length: int = 64) -> None:
        self._poses: deque[tuple[int, FloatArray]] = deque(maxlen=length)

    def add(self, stamp_ns: int, keypoints: FloatArray) -> None:
        """Append a pose (4, 3) [m]; a stamp that goes back starts the timeline anew."""
        if self._poses and stamp_ns < self._poses[-1][0]:
            self._poses.clear()
        self._poses.append((stamp_ns, keypoints))

    def clear(self) -> None:
        """Forget everything."""
        self._poses.clear()

    def at(self, stamp_ns: int) -> FloatArray | None:
        """The pose (4, 3) [m] at a time; none before anything was heard."""
        if not self._poses:
            return None
        later = self._poses[-1]
        if stamp_ns >= later[0]:
            return later[1]
        for earlier in reversed(self._poses):
            if earlier[0] <= stamp_ns:
                share = (stamp_ns - earlier[0]) / max(later[0] - earlier[0], 1)
                return earlier[1] + share * (later[1] - earlier[1])
            later = earlier
        return later[1]


class TrueArms:
    """All arms of a scenario, each with its timeline.

    Args:
        scenario: Who is there, with one arm or with both.

    Attributes:
        timelines: By the arms' names, see :attr:`.Scenario.arms`.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.timelines = {name: ArmTimeline() for name in scenario.arms}
        self._persons = {person.id: person for person in scenario.persons}
        # Of a person of one arm it may be either, but no more than one of them.
        self._sides: dict[str, str] = {}

    def add(self, body_id: str, sample: ArmSample) -> None:
        """Append where an arm of a person was seen as a whole.

        Raises:
            DataError: when the scenario has no such person, or not both of the arms.
        """
        person = self._persons.get(body_id)
        if person is None:
            raise DataError(f"the scene has no person {body_id!r}")
        name = body_id
        if person.both_arms:
            (name,) = (name for name, spec in person.arms.items() if spec.side == sample.side)
        elif self._sides.setdefault(body_id, sample.side) != sample.side:
            raise DataError(
                f"the {sample.side} arm of {body_id} is not in the scene",
                expected=f"the {self._sides[body_id]} one alone",
                hint="give the person of the scenario both_arms: true",
            )
        self.timelines[name].add(sample.stamp_ns, sample.keypoints)
