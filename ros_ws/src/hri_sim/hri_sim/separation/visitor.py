"""A whole simulated person who walks and reaches where the robot is: two arms, trunk and head.

Nobody is faster than is set, whatever they want: each step is cut down until no point of an arm, and
none of trunk and head, goes farther than its speed allows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_sim.people.arm import ArmModel

FloatArray = NDArray[np.float64]

FLOOR_M = -0.75
"""Height of the floor on which people stand: the robot's base is on a table of usual height [m]."""
LEANS = (np.radians(-8.0), np.radians(28.0))
"""How far back and forwards trunks lean [rad]."""
_CUTS = 6
_TO_MODEL = np.array([[-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]])
_SWIVEL = np.full(2, 0.25)


@dataclass(frozen=True)
class Figure:
    """Sizes of a person.

    Attributes:
        shoulder_height: Above the floor [m].
        shoulder_breadth: From joint to joint [m].
        upper_arm: [m].
        forearm: [m].
        hand: [m].
        trunk_radius: [m].
        trunk_length: Shoulders to hips [m].
        lean: Of the trunk forwards, in the beginning [rad].
        aside: Of the trunk to the right, shoulders with it [rad].
        head: Middle of the head before and above the shoulders, of an upright trunk (2,) [m].
        head_radius: [m].
        arm_radii: Of upper arm, forearm and hand [m].
    """

    shoulder_height: float
    shoulder_breadth: float
    upper_arm: float
    forearm: float
    hand: float
    trunk_radius: float
    trunk_length: float
    lean: float
    aside: float
    head: tuple[float, float]
    head_radius: float
    arm_radii: tuple[float, float, float] = (0.05, 0.04, 0.05)


def draw_figure(rng: np.random.Generator) -> Figure:
    """Somebody between a small woman and a tall man, who leans as people do who stand at a table."""
    tall = rng.uniform(1.5, 1.95)
    return Figure(
        shoulder_height=0.82 * tall,
        shoulder_breadth=rng.uniform(0.33, 0.43),
        upper_arm=0.172 * tall,
        forearm=0.157 * tall,
        hand=0.09 * tall,
        trunk_radius=rng.uniform(0.10, 0.15),
        trunk_length=rng.uniform(0.45, 0.55),
        lean=rng.uniform(*LEANS),
        aside=rng.normal(0.0, np.radians(5.0)),
        head=(rng.uniform(0.0, 0.12), rng.uniform(0.15, 0.25)),
        head_radius=rng.uniform(0.10, 0.12),
    )


@dataclass(frozen=True, eq=False)
class Shape:
    """Where a person is.

    Attributes:
        arms: Shoulder, elbow, wrist, hand tip of left and right arm (2, 4, 3) [m].
        body: Axes of trunk and head (n, 2, 3) [m].
        radii: Of the body's axes (n,) [m].
    """

    arms: FloatArray
    body: FloatArray
    radii: FloatArray


@dataclass(frozen=True, eq=False)
class Wish:
    """What a person wants to do now.

    Attributes:
        walking: Velocity over the floor (2,) [m/s].
        hands: Velocities of left and right hand, in the frame of the person (2, 3) [m/s].
        turning: To the left [rad/s].
        leaning: Forwards [rad/s].
    """

    walking: FloatArray
    hands: FloatArray
    turning: float = 0.0
    leaning: float = 0.0


class Visitor:
    """A person who moves.

    Args:
        figure: Sizes.
        place: Where they stand (2,) [m].
        yaw: Which way they look in the beginning; 0 is along +x [rad].
        arm_speed: Fastest that any point of an arm is [m/s].
        body_speed: Fastest that any point of trunk and head is [m/s].
    """

    def __init__(
        self, figure: Figure, place: FloatArray, yaw: float, arm_speed: float, body_speed: float
    ) -> None:
        self.figure = figure
        self._arm_speed, self._body_speed = arm_speed, body_speed
        # Both arms at once: the left one is the mirror image of a right one.
        lengths = (figure.upper_arm, figure.forearm, figure.hand)
        self._model = ArmModel("right", (0.0, 0.0, 0.0), *lengths)
        self._reach = self._model.reach
        half = 0.5 * figure.shoulder_breadth
        inner = max(half - figure.trunk_radius, 0.0)
        # Of an upright person, from the middle of the shoulders: axes of the trunk and of the head.
        axes = [
            [[0.0, aside, 0.0], [0.0, aside, -figure.trunk_length]]
            for aside in (-inner, 0.0, inner)
        ]
        head = (figure.head[0], 0.0, figure.head[1])
        self._body = np.array([*axes, [head, head]])
        self._radii = np.array([*([figure.trunk_radius] * 3), figure.head_radius])
        self._shoulders = np.array([[half], [-half]])
        # The trunk that leans aside, before it leans forwards.
        ca, sa = np.cos(figure.aside), np.sin(figure.aside)
        self._aside = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
        # Aside, for right below the shoulder the elbow would turn over at once.
        left, right = (np.array([0.1, aside, -0.85 * self._reach[1]]) for aside in (0.18, -0.18))
        self._state = np.concatenate((place, (yaw, figure.lean), left, right))
        self.shape = self._pose(self._state)

    @property
    def place(self) -> FloatArray:
        """Where they stand (2,) [m]."""
        return self._state[:2].copy()

    @property
    def hands(self) -> FloatArray:
        """Left and right hand tip, seen from their shoulders, in the frame of the person (2, 3) [m]."""
        return self._state[4:].reshape(2, 3).copy()

    @property
    def lean(self) -> float:
        """How far the trunk leans forwards [rad]."""
        return float(self._state[3])

    @property
    def heading(self) -> FloatArray:
        """Rotation from the person's frame (forward, left, up) to the world's (3, 3)."""
        return _turned(float(self._state[2]))

    def step(self, wish: Wish, dt: float) -> None:
        """Go on for a while, as far as speeds allow.

        Args:
            wish: What the person wants.
            dt: For how long [s].
        """
        body = np.array([*wish.walking, wish.turning, wish.leaning])
        if not self._go(np.concatenate((body, wish.hands.ravel())) * dt, dt):
            # An elbow that would turn over holds up the hands, not the feet.
            self._go(np.concatenate((body, np.zeros(6))) * dt, dt)

    def _go(self, wanted: FloatArray, dt: float) -> bool:
        """Take a step as far as speeds allow; whether there was one."""
        share = 1.0
        for _ in range(_CUTS):
            state = self._state + share * wanted
            state[3] = min(max(state[3], LEANS[0]), LEANS[1])
            state[4:] = self._within_reach(state[4:].reshape(2, 3)).ravel()
            shape = self._pose(state)
            arms = _farthest(shape.arms, self.shape.arms)
            body = _farthest(shape.body, self.shape.body)
            if arms <= self._arm_speed * dt and body <= self._body_speed * dt:
                self._state, self.shape = state, shape
                return True
            share *= 0.98 * min(
                self._arm_speed * dt / max(arms, 1e-12),
                self._body_speed * dt / max(body, 1e-12),
                1.0,
            )
        return False

    def _within_reach(self, hands: FloatArray) -> FloatArray:
        low, high = self._reach
        distance = np.sqrt((hands * hands).sum(axis=1, keepdims=True))
        allowed = np.minimum(np.maximum(distance, 1.02 * low), 0.98 * high)
        return hands * allowed / np.maximum(distance, 1e-9)

    def _pose(self, state: FloatArray) -> Shape:
        turn = _turned(float(state[2]))
        middle = np.array([state[0], state[1], FLOOR_M + self.figure.shoulder_height])
        # Axes of the trunk: forward, left, up.
        c, s = math.cos(state[3]), math.sin(state[3])
        trunk = self._aside @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        # The arm model looks along -x, with the right arm on the side of +y.
        hands = state[4:].reshape(2, 3) * _TO_MODEL
        points = self._model.posture(hands, _SWIVEL) * _TO_MODEL[:, None]
        points += (self._shoulders * trunk[:, 1])[:, None]
        arms = middle + points @ turn.T
        body = middle + self._body @ trunk.T @ turn.T
        return Shape(arms, body, self._radii)


def _farthest(places: FloatArray, before: FloatArray) -> float:
    """How far the point (..., 3) went that went farthest [m]."""
    way = places - before
    return math.sqrt((way * way).sum(axis=-1).max())


def _turned(yaw: float) -> FloatArray:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
