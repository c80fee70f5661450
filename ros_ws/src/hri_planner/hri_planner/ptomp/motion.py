"""Motions on the grid of one replan: what proposals are made of and what the optimiser changes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.plan import JointPlan, connect

FloatArray = NDArray[np.float64]
State = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Grid:
    """Uniform times of a replan.

    Attributes:
        start_s: Hand-over, plan clock [s].
        step: Spacing [s].
        knots: Number of knots from the hand-over on.
        state: Joint state (q, qd, qdd) at the hand-over.
        past: Angles two and one steps before the hand-over (2, 7) [rad].
    """

    start_s: float
    step: float
    knots: int
    state: State
    past: FloatArray

    @property
    def offsets(self) -> FloatArray:
        """Times of the knots after the hand-over (knots,) [s]."""
        return np.asarray(self.step * np.arange(self.knots), dtype=np.float64)

    @property
    def columns_s(self) -> FloatArray:
        """Plan-clock times of the kernel's columns: two of the past, then the knots [s]."""
        return np.asarray(self.start_s + self.step * np.arange(-2, self.knots), dtype=np.float64)


@dataclass(frozen=True)
class Motion:
    """A motion from the hand-over to rest.

    Attributes:
        kind: Where it comes from: plan, posture, direct, slow, pause, detour, around, excursion,
            stop or retreat.
        q: Angles at the knots (knots, 7) [rad]; qd and qdd are their derivatives.
        qd: [rad/s].
        qdd: [rad/s^2].
        arrival: Knot from which on it rests at the goal; None when it ends elsewhere.
    """

    kind: str
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    arrival: int | None

    def columns(self, grid: Grid) -> FloatArray:
        """The kernel's layout (7, knots + 2)."""
        return np.ascontiguousarray(np.concatenate((grid.past, self.q)).T)

    def moved(self, offset: FloatArray, step: float, kind: str | None = None) -> Motion:
        """The motion plus a smooth offset (knots, 7) that is zero at the first knot.

        The hand-over keeps its velocity and acceleration, and the last knot stays at rest.
        """
        rate, bend = np.zeros_like(offset), np.zeros_like(offset)
        rate[1:-1] = (offset[2:] - offset[:-2]) / (2.0 * step)
        bend[1:-1] = (offset[2:] - 2.0 * offset[1:-1] + offset[:-2]) / step**2
        if self.arrival is not None:
            rate[self.arrival :] = 0.0
            bend[self.arrival :] = 0.0
        return replace(
            self, kind=kind or self.kind, q=self.q + offset, qd=self.qd + rate, qdd=self.qdd + bend
        )

    def to_plan(self, grid: Grid) -> JointPlan:
        """The motion as a plan that ends with the arrival."""
        last = grid.knots if self.arrival is None else max(self.arrival, 1) + 1
        times = grid.start_s + grid.offsets[:last]
        return JointPlan(times, self.q[:last].copy(), self.qd[:last].copy(), self.qdd[:last].copy())


def from_plan(plan: JointPlan, grid: Grid, arrives: bool, kind: str = "plan") -> Motion:
    """The present plan sampled on a grid whose hand-over it defines."""
    q, qd, qdd = plan.sample(grid.start_s + grid.offsets)
    q[0], qd[0], qdd[0] = grid.state
    arrival = None
    if arrives:
        arrival = int(np.ceil((plan.end_s - grid.start_s) / grid.step - 1e-6))
        arrival = min(max(arrival, 0), grid.knots - 1)
        q[arrival:] = plan.q[-1]
        if arrival > 0:
            qd[arrival:] = 0.0
            qdd[arrival:] = 0.0
    if not arrives or arrival:
        qd[-1] = 0.0
        qdd[-1] = 0.0
    return Motion(kind, q, qd, qdd, arrival)


def to_posture(
    grid: Grid, q_end: FloatArray, duration_s: float, kind: str, arrives: bool
) -> Motion | None:
    """Quintic from the hand-over to rest at a posture; None when the grid is too short."""
    arrival = int(np.ceil(duration_s / grid.step))
    if arrival >= grid.knots:
        return None
    arrival = max(arrival, 1)
    q, qd, qdd = connect(grid.state, q_end, arrival * grid.step, grid.offsets)
    q[arrival:] = q_end
    qd[arrival:] = 0.0
    qdd[arrival:] = 0.0
    return Motion(kind, q, qd, qdd, arrival if arrives else None)
