"""Another way to the goal: a search that goes on over many replans.

Where the present plan is blocked, the way around (over or behind the person's arm, to another
posture) costs more than waiting until it has been optimised, and one replan is too short for that.
So the best such way is remembered between replans and improved until it wins.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.detour import detour_motions
from hri_planner.ptomp.motion import Grid, Motion, to_posture
from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.ptomp.timing import fastest_duration
from hri_planner.robot.ik import ik_candidates
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_SLACK = 1.3  # a way around takes longer than the fastest motion
_LATEST_S = 2.1
_POSTURES = 12
_SHIFTS = 5
_SHIFT_LOW = (-0.35, -0.2, -0.05)  # mostly up and back towards the robot, m
_SHIFT_HIGH = (0.05, 0.2, 0.45)


class WayAround:
    """The remembered way, as an offset from the direct motion to its final posture.

    Args:
        robot: The robot.
        acceleration_limit: [rad/s^2].
        rng: Picks postures.
    """

    def __init__(
        self, robot: RobotModel, acceleration_limit: float, rng: np.random.Generator
    ) -> None:
        self._robot = robot
        self._limit = acceleration_limit
        self._rng = rng
        self._offset: JointPlan | None = None
        self._posture = np.zeros(7)

    def forget(self) -> None:
        """Begin a new search."""
        self._offset = None

    @property
    def memory(self) -> tuple[JointPlan | None, FloatArray]:
        """What is remembered, to go back to: the offset and the final posture (7,) [rad]."""
        return self._offset, self._posture

    @memory.setter
    def memory(self, memory: tuple[JointPlan | None, FloatArray]) -> None:
        self._offset, self._posture = memory

    def remember(self, motion: Motion, grid: Grid) -> None:
        """Keep a motion that arrives, for the next replan."""
        arrival = motion.arrival
        if arrival is None or arrival < 2:
            return
        self._posture = motion.q[arrival].copy()
        times = grid.offsets[: arrival + 1]
        direct = connect(grid.state, self._posture, times[-1], times)
        parts = (motion.q, motion.qd, motion.qdd)
        q, qd, qdd = (a[: arrival + 1] - b for a, b in zip(parts, direct, strict=True))
        self._offset = JointPlan(times, q, qd, qdd)

    def proposals(self, grid: Grid, goal: FloatArray, seed: FloatArray) -> list[Motion]:
        """The remembered way from the present state, and fresh ones to one random posture.

        Args:
            grid: Grid of this replan.
            goal: Tool goal (3,) [m].
            seed: Posture (7,) near which the inverse kinematics looks.
        """
        motions = []
        if self._offset is not None:
            direct = self._direct(grid, self._posture, self._offset.end_s)
            if direct is not None and direct.arrival is not None:
                share = np.minimum(np.arange(grid.knots) / direct.arrival, 1.0)
                offset = self._offset.sample(share * self._offset.end_s)[0]
                motions.append(direct.moved(offset, grid.step, "around"))
        postures = ik_candidates(self._robot, goal, seed, self._rng, count=_POSTURES)
        posture = postures[self._rng.integers(len(postures))]
        shifts = self._rng.uniform(_SHIFT_LOW, _SHIFT_HIGH, (_SHIFTS, 3))
        fresh = self._direct(grid, posture, 0.0)
        if fresh is not None:
            motions.append(fresh)
            motions += detour_motions(fresh, grid, self._robot, shifts, "around")
        return motions

    def _direct(self, grid: Grid, posture: FloatArray, duration_s: float) -> Motion | None:
        fastest = fastest_duration(self._robot, self._limit, grid.state, posture)
        seconds = max(duration_s, min(_SLACK * fastest, _LATEST_S), fastest)
        return to_posture(grid, posture, seconds, "around", True)
