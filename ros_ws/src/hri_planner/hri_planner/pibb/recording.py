"""What is seen of robot and person in a trial, and what comes of it: the answer, and the terms of the cost.

Times are stamps: of joint states, of motion capture, of a pressed key. The person's answer is the first of
a pressed key and a hand that has arrived at a target.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import PERIOD_S, DmpPolicy
from hri_planner.pibb.costs import Terms, deviation, squared_jerk
from hri_planner.robot.model import RobotModel
from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

NANO = 1_000_000_000
AHEAD_NS = 200_000_000
"""Clocks may be so far ahead [ns]."""
BESIDE_M = 0.6
"""Hands farther from all targets are not those of who takes part [m]."""
STILL_M = 0.02
"""A hand that stays within so much rests [m]."""
_SPAN_NS = 40_000_000
"""Speeds of hands are over so long [ns]."""


def check_clock(what: str, stamp_ns: int, now_ns: int) -> None:
    """Check that a stamp [ns] is not one of the future.

    Raises:
        DataError: when it is.
    """
    if stamp_ns > now_ns + AHEAD_NS:
        raise DataError(
            f"{what} is stamped {(stamp_ns - now_ns) / NANO:.2f} s ahead of the clock",
            expected=f"no more than {AHEAD_NS / NANO:.1f} s",
            hint="set both machines' clocks by the same time server",
        )


class Stirring:
    """Since when the hands beside the targets have rested.

    Args:
        targets: Where hands go (3,) [m]; none: hands do not count.
    """

    def __init__(self, targets: Iterable[FloatArray]) -> None:
        self._targets = [np.array(place, dtype=float) for place in targets]
        self._rests: dict[str, FloatArray] = {}
        self._moved_ns: int | None = None

    def hand(self, whose: str, stamp_ns: int, tip: FloatArray) -> None:
        """Take the place of a hand (3,) [m] with its stamp [ns]."""
        if all(np.linalg.norm(place - tip) > BESIDE_M for place in self._targets):
            self._rests.pop(whose, None)
            return
        rest = self._rests.get(whose)
        if rest is None or np.linalg.norm(tip - rest) > STILL_M:
            self._rests[whose] = np.array(tip, dtype=float)
            self._moved_ns = stamp_ns

    def since(self, now_ns: int) -> int:
        """For how long none has moved [ns]; very long when none has been seen."""
        return now_ns if self._moved_ns is None else now_ns - self._moved_ns


@dataclass(frozen=True)
class AnswerConfig:
    """How a hand answers.

    Raises:
        ConfigError: when a value is out of range.
    """

    hand_radius: float = parameter(
        0.05, "A hand so near to a target has arrived there", unit="m", low=0.005, high=0.3
    )
    hand_speed: float = parameter(
        0.15, "If it is no faster; from when on it was faster, its motion is counted", unit="m/s",
        low=0.01, high=5.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)


@dataclass(frozen=True)
class Answer:
    """What the person showed.

    Attributes:
        goal: Name of the goal.
        stamp_ns: When [ns].
        hand_s: How long the hand had moved [s]; 0 for a pressed key.
    """

    goal: str
    stamp_ns: int
    hand_s: float


class Recording:
    """Of one trial.

    Args:
        robot: The robot.
        targets: Where a hand goes for each goal (3,) [m]; empty: only keys count.
        config: How a hand answers.

    Attributes:
        answer: The first answer; none so far.
        began_ns: When the robot began to move [ns]; none so far.
    """

    def __init__(
        self, robot: RobotModel, targets: Mapping[str, FloatArray], config: AnswerConfig
    ) -> None:
        self._robot, self._targets, self._config = robot, dict(targets), config
        self._stamps: list[int] = []
        self._joints: list[FloatArray] = []
        self._hands: dict[str, tuple[list[int], list[FloatArray]]] = {}
        self.answer: Answer | None = None
        self.began_ns: int | None = None

    def begin(self, stamp_ns: int) -> None:
        """The robot begins to move: its first plan takes effect [ns]."""
        if self.began_ns is None:
            self.began_ns = stamp_ns

    def joints(self, stamp_ns: int, q: FloatArray) -> None:
        """Take joint angles (7,) [rad] with their stamp [ns]; those out of order are left out."""
        if self._stamps and stamp_ns <= self._stamps[-1]:
            return
        self._stamps.append(stamp_ns)
        self._joints.append(np.array(q, dtype=float))

    def hand(self, whose: str, stamp_ns: int, tip: FloatArray) -> None:
        """Take the place of a hand (3,) [m] with its stamp [ns]; those out of order are left out."""
        stamps, places = self._hands.setdefault(whose, ([], []))
        if stamps and stamp_ns <= stamps[-1]:
            return
        stamps.append(stamp_ns)
        places.append(np.array(tip, dtype=float))
        earlier = self.answer is not None and self.answer.stamp_ns <= stamp_ns
        if earlier or not self._targets:
            return
        name = min(self._targets, key=lambda n: float(np.linalg.norm(self._targets[n] - tip)))
        if np.linalg.norm(self._targets[name] - tip) > self._config.hand_radius:
            return
        began_ns = self._onset_ns(stamps, places)
        if began_ns is not None:
            self.answer = Answer(name, stamp_ns, (stamp_ns - began_ns) / NANO)

    def _onset_ns(self, stamps: list[int], places: list[FloatArray]) -> int | None:
        """When the motion began that is over now [ns]; none: it is not over, or nothing is known of it."""
        now = len(stamps) - 1
        speed = self._speed_at(now, stamps, places)
        if speed is None or speed > self._config.hand_speed:
            return None
        fast = [
            index
            for index in range(now)
            if (found := self._speed_at(index, stamps, places)) is not None
            and found > self._config.hand_speed
        ]
        if not fast:
            return stamps[now]
        # Backwards from the last time that it was fast to where it was not.
        first = fast[-1]
        for index in reversed(fast):
            if first - index > 1:
                break
            first = index
        return stamps[first]

    @staticmethod
    def _speed_at(index: int, stamps: list[int], places: list[FloatArray]) -> float | None:
        """Over so long a way back that noise leaves it alone [m/s]; none: that is not known."""
        for before in range(index - 1, -1, -1):
            passed_ns = stamps[index] - stamps[before]
            if passed_ns >= _SPAN_NS:
                way = float(np.linalg.norm(places[index] - places[before]))
                return way / (passed_ns / NANO)
        return None

    def press(self, goal: str, stamp_ns: int) -> None:
        """Take a pressed key [ns]; the first answer counts.

        Raises:
            DataError: when it was pressed before the robot began to move.
        """
        if self.began_ns is None or stamp_ns < self.began_ns:
            raise DataError(
                f"the guess {goal!r} came before the robot moved", expected="one that was read"
            )
        if self.answer is None or stamp_ns < self.answer.stamp_ns:
            self.answer = Answer(goal, stamp_ns, 0.0)

    def terms(self, policy: DmpPolicy, goal: str, indistinct: float) -> Terms:
        """Of the costs of the trial.

        Args:
            policy: Whose way to the goal was gone.
            goal: Its name.
            indistinct: J_delta of the way [1/m].

        Raises:
            DataError: when there is no answer, or too little was seen of the robot.
        """
        if self.answer is None or self.began_ns is None:
            raise DataError("no answer" if self.began_ns else "the robot did not move")
        stamps = np.array(self._stamps, dtype=np.int64)
        seconds = (stamps - self.began_ns) / NANO
        if not len(seconds) or seconds[-1] <= 0.0:
            raise DataError("nothing was heard of the robot's joints")
        grid = np.arange(0.0, float(seconds[-1]), PERIOD_S)
        angles = np.array(self._joints)
        joints = np.stack([np.interp(grid, seconds, column) for column in angles.T], axis=1)
        tool = self._robot.frames(joints)[:, 3]
        return Terms(
            tool_jerk=squared_jerk(tool, PERIOD_S),
            joint_jerk=squared_jerk(joints, PERIOD_S),
            prediction_time=(self.answer.stamp_ns - self.began_ns) / NANO,
            task=0.0 if self.answer.goal == goal else 1.0,
            deviation=deviation(tool, policy.path(goal)),
            human_duration=self.answer.hand_s,
            indistinct=indistinct,
        )
