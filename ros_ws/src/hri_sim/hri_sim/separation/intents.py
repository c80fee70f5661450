"""What visitors want: to walk past or through, to reach, or to get hold of the robot at once."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from hri_sim.separation.visitor import Visitor

FloatArray = NDArray[np.float64]


class Intent(ABC):
    """What a visitor wants."""

    @abstractmethod
    def velocities(
        self, visitor: Visitor, robot: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Wanted velocities over the floor (2,) and of the hands (2, 3) [m/s], see :meth:`Visitor.step`.

        Args:
            visitor: Who.
            robot: Shoulder, elbow, wrist and tool of the robot (4, 3) [m].
            time_s: Since the encounter began [s].
        """


class Walking(Intent):
    """Walks straight on with swinging arms, as if the robot was not there.

    Step rate and swing grow with speed as in Murray et al. (1967): some 1.9 steps a second at 1.5 m/s,
    hands that swing through 40 degrees.

    Args:
        velocity: Over the floor (2,) [m/s].
        phase: Of the swing when it begins [rad].
    """

    def __init__(self, velocity: FloatArray, phase: float) -> None:
        self._velocity, self._phase = velocity, phase
        speed = float(np.linalg.norm(velocity))
        self._frequency = 2.0 * np.pi * (0.4 + 0.37 * speed)
        self._swing = 0.35 * min(speed / 1.5, 1.0)

    def velocities(
        self, visitor: Visitor, robot: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Straight on."""
        hands = visitor.hands
        rate = self._swing * self._frequency * np.cos(self._frequency * time_s + self._phase)
        wanted = np.zeros((2, 3))
        for index, sign in enumerate((1.0, -1.0)):
            wanted[index, 0] = -sign * rate * hands[index, 2]
            wanted[index, 2] = sign * rate * hands[index, 0]
        return self._velocity, wanted


class Reaching(Intent):
    """Reaches where the tool was when it began, and back, in smooth strokes; stands meanwhile.

    Args:
        hand: Which hand, 0 left, 1 right.
        duration: Of a stroke [s].
        rest: Between strokes [s].
        aside: Added to the place (3,) [m].
    """

    def __init__(self, hand: int, duration: float, rest: float, aside: FloatArray) -> None:
        self._hand, self._duration, self._rest, self._aside = hand, duration, rest, aside
        self._stroke = -1
        self._ends = np.zeros((2, 3))
        self._home: FloatArray | None = None

    def velocities(
        self, visitor: Visitor, robot: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
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
        return np.zeros(2), wanted


class Chasing(Intent):
    """Goes for the nearest point of the robot with a hand, always as fast as can be, and turns at once.

    Nobody does that; but it is the worst that a speed allows.

    Args:
        hand: Which hand, 0 left, 1 right.
        begin: When it begins; till then the visitor stands [s].
    """

    def __init__(self, hand: int, begin: float) -> None:
        self._hand, self._begin = hand, begin

    def velocities(
        self, visitor: Visitor, robot: FloatArray, time_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Straight at it."""
        if time_s < self._begin:
            return np.zeros(2), np.zeros((2, 3))
        tip = visitor.shape.arms[self._hand, 3]
        shares = np.linspace(0.0, 1.0, 5)[:, None]
        points = np.concatenate(
            [robot[link] + shares * (robot[link + 1] - robot[link]) for link in range(3)]
        )
        way = points[np.linalg.norm(points - tip, axis=1).argmin()] - tip
        way /= max(float(np.linalg.norm(way)), 1e-9)
        wanted = np.zeros((2, 3))
        wanted[self._hand] = visitor.heading.T @ (way * 2.0)
        return 1.6 * way[:2], wanted
