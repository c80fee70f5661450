"""Whether the robot is as it is reckoned with: its joint speeds, and what paths ask of it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

JOINT_WINDOW_NS = 20_000_000
"""Angles of so long tell how fast the joints were [ns]."""
FORTH = 25
"""So many joint states in a row whose stamps go on are of one source: more than one tick hands over."""
SAME_RAD = 0.01
"""Angles that are farther apart than the joints can have turned, and this, are of two sources [rad]."""
PATH_WINDOW_S = 0.1
"""Gains of speed are looked at through so much of the path [s]."""
_NANO = 1e-9


@dataclass(eq=False)
class JointWatch:
    """Joint speeds as they are said, against what the angles make of them.

    A driver that says zeros, or scales them, would make S_r too small. Where two sources speak, whose
    stamps go back and forth, or whose angles jump from each to the next, neither is believed.

    Args:
        most: How far they may be apart [rad/s].

    Attributes:
        apart: Of the joint that is farthest apart now, through the window [rad/s].
        joint: Which one.
        mixed: Whether joint states are of two sources.
    """

    most: float
    apart: float = 0.0
    joint: int = 0
    mixed: bool = False
    _forth: int = FORTH
    _ring: deque[tuple[int, FloatArray, FloatArray]] = field(default_factory=deque)

    def take(self, stamp_ns: int, q: FloatArray, qd: FloatArray) -> None:
        """Take joint states; of one stamp the first counts, and stamps that go back once begin anew.

        Args:
            stamp_ns: When they were measured [ns].
            q: Joint angles (7,) [rad].
            qd: Joint speeds (7,) [rad/s].
        """
        ring = self._ring
        if ring and 0 <= stamp_ns - ring[-1][0] <= JOINT_WINDOW_NS:
            before_ns, before, before_qd = ring[-1]
            fastest = max(float(np.abs(qd).max()), float(np.abs(before_qd).max())) + self.most
            jumped = float(np.abs(q - before).max())
            if jumped > SAME_RAD + fastest * (stamp_ns - before_ns) * _NANO:
                self.mixed, self._forth = True, 0
            if stamp_ns == before_ns:
                return
        if ring and stamp_ns < ring[-1][0]:
            # A clock goes back once.
            self.mixed, self._forth = self.mixed or self._forth < FORTH, 0
            ring.clear()
        else:
            self._forth += 1
            self.mixed = self.mixed and self._forth < FORTH
        ring.append((stamp_ns, q, qd))
        self.apart, self.joint = 0.0, 0
        if stamp_ns - ring[0][0] < JOINT_WINDOW_NS:
            return
        while stamp_ns - ring[1][0] >= JOINT_WINDOW_NS:
            ring.popleft()
        turned = q - ring[0][1]
        said = np.zeros(7)
        for (before_ns, _, before), (after_ns, _, after) in zip(ring, list(ring)[1:], strict=False):
            said += 0.5 * (before + after) * ((after_ns - before_ns) * _NANO)
        apart = np.abs(turned - said) / ((stamp_ns - ring[0][0]) * _NANO)
        self.joint = int(apart.argmax())
        self.apart = float(apart[self.joint])

    @property
    def contradicts(self) -> bool:
        """Whether the speeds are not those of the angles."""
        return self.apart > self.most

    def restart(self) -> None:
        """What was heard counts no more."""
        self._ring.clear()
        self.apart, self.joint = 0.0, 0
        self.mixed, self._forth = False, FORTH


@dataclass(eq=False)
class PathWatch:
    """What paths ask of the robot, at full rate.

    Attributes:
        fastest: Speed of the fastest point so far [m/s].
        gained: What any point's velocity has changed by so far, a second of the path [m/s²].
    """

    fastest: float = 0.0
    gained: float = 0.0
    _last_ns: int | None = None
    _path_s: float = 0.0
    _ring: deque[tuple[float, FloatArray]] = field(default_factory=deque)

    def take(self, now_ns: int, rate: float, moving: FloatArray | None) -> None:
        """Take how the path is now.

        Args:
            now_ns: The time [ns].
            rate: At which it is followed, 0...1.
            moving: Velocities of points of the robot at full rate (k, 3) [m/s]; none: not known.
        """
        passed = 0.0 if self._last_ns is None else (now_ns - self._last_ns) * _NANO
        self._last_ns = now_ns
        ring = self._ring
        if moving is None or not 0.0 <= passed <= PATH_WINDOW_S:
            ring.clear()
            self._path_s = 0.0
            if moving is None:
                return
            passed = 0.0
        self._path_s += passed * rate
        self.fastest = max(self.fastest, float(np.linalg.norm(moving, axis=-1).max()))
        ring.append((self._path_s, moving.copy()))
        while len(ring) > 1 and self._path_s - ring[1][0] >= PATH_WINDOW_S:
            ring.popleft()
        span = self._path_s - ring[0][0]
        if span >= PATH_WINDOW_S:
            change = np.linalg.norm(moving - ring[0][1], axis=-1).max() / span
            self.gained = max(self.gained, float(change))
