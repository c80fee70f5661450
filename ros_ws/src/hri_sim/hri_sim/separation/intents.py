"""What visitors want: to walk past or through, to reach, or to get hold of the robot at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_sim.separation.visitor import Visitor, Wish

FloatArray = NDArray[np.float64]


class Intent(ABC):
    """What a visitor wants."""

    @abstractmethod
    def wish(self, visitor: Visitor, robot: FloatArray, time_s: float) -> Wish:
        """What they want now.

        Args:
            visitor: Who.
            robot: Shoulder, elbow, wrist and tool of the robot (4, 3) [m].
            time_s: Since the encounter began [s].
        """


@dataclass(frozen=True)
class Change:
    """What somebody who walks does otherwise for a while.

    Attributes:
        until_s: From the change before to here [s].
        pace: Factor on the speed: 0 stands, below 0 steps back.
        turning: To the left [rad/s].
        leaning: Forwards [rad/s].
    """

    until_s: float
    pace: float = 1.0
    turning: float = 0.0
    leaning: float = 0.0


def draw_changes(rng: np.random.Generator, duration_s: float) -> tuple[Change, ...]:
    """Somebody who cannot make up their mind: goes on, stops, steps back, turns, bends."""
    found: list[Change] = []
    until_s = 0.0
    while until_s < duration_s:
        until_s += rng.uniform(0.2, 0.8)
        turning, leaning = rng.uniform(-4.0, 4.0), rng.uniform(-1.5, 1.5)
        found.append(
            (
                Change(until_s),
                Change(until_s, pace=0.0),
                Change(until_s, pace=-rng.uniform(0.3, 1.0)),
                Change(until_s, pace=rng.uniform(0.0, 1.0), turning=turning),
                Change(until_s, pace=rng.uniform(0.0, 1.0), leaning=leaning),
            )[rng.integers(5)]
        )
    return tuple(found)


class Walking(Intent):
    """Walks with swinging arms to where they look, as if the robot was not there.

    Step rate and swing grow with speed as in Murray et al. (1967): some 1.9 steps a second at 1.5 m/s,
    hands that swing through 40 degrees.

    Args:
        speed: Over the floor [m/s].
        phase: Of the swing when it begins [rad].
        changes: What they do meanwhile, in the order of time; afterwards they walk straight on.
    """

    def __init__(self, speed: float, phase: float, changes: Sequence[Change] = ()) -> None:
        self._speed, self._phase, self._changes = speed, phase, tuple(changes)
        self._frequency = 2.0 * np.pi * (0.4 + 0.37 * speed)
        self._swing = 0.35 * min(speed / 1.5, 1.0)

    def wish(self, visitor: Visitor, robot: FloatArray, time_s: float) -> Wish:
        """On, as they please."""
        now = next((c for c in self._changes if time_s < c.until_s), Change(np.inf))
        hands = visitor.hands
        angle = self._frequency * time_s + self._phase
        rate = abs(now.pace) * self._swing * self._frequency * np.cos(angle)
        wanted = np.zeros((2, 3))
        for index, sign in enumerate((1.0, -1.0)):
            wanted[index, 0] = -sign * rate * hands[index, 2]
            wanted[index, 2] = sign * rate * hands[index, 0]
        ahead = visitor.heading[:2, 0]
        return Wish(now.pace * self._speed * ahead, wanted, now.turning, now.leaning)


class Reaching(Intent):
    """Reaches where the tool was when it began, and back, in smooth strokes, the trunk with the hand.

    The hips stay where they are.

    Args:
        hand: Which hand, 0 left, 1 right.
        duration: Of a stroke [s].
        rest: Between strokes [s].
        aside: Added to the place (3,) [m].
        bend: How far the trunk leans forwards on top, at the end of a stroke [rad].
    """

    def __init__(
        self, hand: int, duration: float, rest: float, aside: FloatArray, bend: float = 0.0
    ) -> None:
        self._hand, self._duration, self._rest, self._aside = hand, duration, rest, aside
        self._bend = bend
        self._stroke = -1
        self._ends = np.zeros((2, 3))
        self._home: FloatArray | None = None

    def wish(self, visitor: Visitor, robot: FloatArray, time_s: float) -> Wish:
        """Minimum jerk from one end to the other."""
        stroke = int(time_s // (self._duration + self._rest))
        here = visitor.hands[self._hand]
        if stroke != self._stroke:
            self._stroke = stroke
            if self._home is None:
                self._home = here
            shoulder = visitor.shape.arms[self._hand, 0]
            there = visitor.heading.T @ (robot[3] + self._aside - shoulder)
            self._ends = np.stack((here, there if stroke % 2 == 0 else self._home))
        s = (time_s - stroke * (self._duration + self._rest)) / self._duration
        rate = 30.0 * (s * (1.0 - s)) ** 2 / self._duration if 0.0 < s < 1.0 else 0.0
        wanted = np.zeros((2, 3))
        wanted[self._hand] = rate * (self._ends[1] - self._ends[0])
        forth = 1.0 if stroke % 2 == 0 else -1.0
        leaning = forth * rate * self._bend
        # Shoulders go forwards over hips that stay.
        ahead = visitor.figure.trunk_length * np.cos(visitor.lean) * leaning
        return Wish(ahead * visitor.heading[:2, 0], wanted, leaning=leaning)


class Chasing(Intent):
    """Goes for the nearest point of the robot with a hand, always as fast as can be, and turns at once.

    Nobody does that; but it is the worst that a speed allows.

    Args:
        hand: Which hand, 0 left, 1 right.
        begin: When it begins; till then the visitor stands [s].
    """

    def __init__(self, hand: int, begin: float) -> None:
        self._hand, self._begin = hand, begin

    def wish(self, visitor: Visitor, robot: FloatArray, time_s: float) -> Wish:
        """Straight at it."""
        if time_s < self._begin:
            return Wish(np.zeros(2), np.zeros((2, 3)))
        tip = visitor.shape.arms[self._hand, 3]
        shares = np.linspace(0.0, 1.0, 5)[:, None]
        points = np.concatenate(
            [robot[link] + shares * (robot[link + 1] - robot[link]) for link in range(3)]
        )
        way = points[np.linalg.norm(points - tip, axis=1).argmin()] - tip
        way /= max(float(np.linalg.norm(way)), 1e-9)
        wanted = np.zeros((2, 3))
        wanted[self._hand] = visitor.heading.T @ (way * 2.0)
        return Wish(1.6 * way[:2], wanted)
