"""A joint-space plan: knots with position, velocity and acceleration, quintic between them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp import quintic
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class JointPlan:
    """Knots of a motion; the curve between them is twice continuously differentiable.

    Attributes:
        time_s: Plan clock (N,), strictly increasing [s].
        q: Joint angles (N, 7) [rad].
        qd: Joint velocities (N, 7) [rad/s].
        qdd: Joint accelerations (N, 7) [rad/s^2].
    """

    time_s: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray

    def __post_init__(self) -> None:
        """Check shapes and the clock."""
        for name in ("time_s", "q", "qd", "qdd"):
            array = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, array)
        count = len(self.time_s)
        shapes = {np.shape(values) for values in (self.q, self.qd, self.qdd)}
        if count < 1 or shapes != {(count, 7)}:
            raise PlanningError(
                f"plan of shapes {shapes}", expected=f"({count}, 7) each, not empty"
            )
        if np.any(np.diff(self.time_s) <= 0.0):
            raise PlanningError("plan times do not increase")

    @property
    def start_s(self) -> float:
        """Time of the first knot [s]."""
        return float(self.time_s[0])

    @property
    def end_s(self) -> float:
        """Time of the last knot [s]."""
        return float(self.time_s[-1])

    def sample(self, t: float | FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """State at one time or at times (n,).

        Outside of the knots the robot stands still at the first or last one.

        Returns:
            q, qd, qdd of shape (7,) or (n, 7).
        """
        times = np.atleast_1d(np.asarray(t, dtype=float))
        states = np.empty((3, len(times), 7))
        quintic.sample(self.time_s, self.q, self.qd, self.qdd, times, states)
        q, qd, qdd = states
        if np.ndim(t) == 0:
            return q[0], qd[0], qdd[0]
        return q, qd, qdd

    def shifted(self, seconds: float) -> JointPlan:
        """The same motion later by so many seconds."""
        return replace(self, time_s=self.time_s + seconds)

    def remaining(self, time_s: float) -> JointPlan:
        """The motion from a time on; a single resting knot when it is over."""
        if time_s <= self.start_s:
            return self
        q, qd, qdd = self.sample(time_s)
        # A knot that is nearly here would only make a needlessly short piece.
        later = self.time_s > time_s + 1e-3
        later[-1] = self.end_s > time_s + 1e-9
        return JointPlan(
            np.concatenate(([time_s], self.time_s[later])),
            np.concatenate((q[None], self.q[later])),
            np.concatenate((qd[None], self.qd[later])),
            np.concatenate((qdd[None], self.qdd[later])),
        )


def connect(
    state: tuple[FloatArray, FloatArray, FloatArray],
    q_end: FloatArray,
    duration_s: float,
    times_s: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Quintic from a state to rest: q, qd, qdd (n, 7) at times (n,) after its start.

    Args:
        state: (q, qd, qdd), each (7,), at time 0.
        q_end: Posture (7,) [rad] at rest at ``duration_s``; held afterwards.
        duration_s: Duration [s], positive.
        times_s: Times (n,) >= 0 [s].
    """
    q0, v0, a0 = state
    zero = np.zeros((1, 7))
    curve = JointPlan(
        np.array([0.0, duration_s]),
        np.stack((q0, q_end)),
        np.concatenate((v0[None], zero)),
        np.concatenate((a0[None], zero)),
    )
    return curve.sample(times_s)
