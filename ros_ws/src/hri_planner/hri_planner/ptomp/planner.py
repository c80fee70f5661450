"""PTOMP: progressive trajectory optimisation around where a person will be (chapter 6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import LOOK_S, PtompConfig
from hri_planner.ptomp.costs import CostModel, TableBox
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.layout import MAX_COLUMNS, TERMS
from hri_planner.ptomp.motion import Grid, Motion, from_plan
from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.ptomp.result import ReplanResult
from hri_planner.ptomp.search import TROUBLE, MotionSearch, Task, candidate
from hri_planner.ptomp.timing import fastest_duration
from hri_planner.robot.ik import ik_candidates
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

STAGES = ("idle", "reaching", "waiting", "holding")

_AT_GOAL_M = 1e-4  # plans that arrive end nearer to the goal than this
_OVERDUE_GRACE_S = 0.3
_LATE_S = 0.05  # from which delay on a plan counts as late


@dataclass(frozen=True)
class PlannerSnapshot:
    """State of a planner between two replans; opaque to callers."""

    plan: JointPlan | None
    stage: str
    posture: FloatArray
    arrives: bool
    posture_changed_s: float
    settled: bool


class PtompPlanner:
    """Plans one reach at a time and replans it while it runs.

    Costs a few milliseconds a replan on one core. One thread at a time may use a planner, since it
    works in buffers of its own; the kernels release the interpreter lock.

    Args:
        robot: The robot.
        config: Weights, margins, sizes.
        rng: Source of all randomness.
        table: Table to stay above, if any.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: PtompConfig,
        rng: np.random.Generator,
        table: TableBox | None = None,
    ) -> None:
        self.robot = robot
        self.config = config
        self.table = table
        self._rng = rng
        self._costs = CostModel(robot, config, table)
        self._search = MotionSearch(robot, config, self._costs, rng)
        self.stage = "idle"
        self.plan: JointPlan | None = None
        self._goal = np.zeros(3)
        self._posture = np.zeros(7)
        self._home = np.zeros(7)
        self._start_s = 0.0
        self._duration_s = 1.5
        self._arrives = False
        self._posture_changed_s = -np.inf
        self._settled = False

    def start(
        self,
        q0: FloatArray,
        qd0: FloatArray,
        goal_position: FloatArray,
        duration_s: float,
        time0_s: float,
    ) -> JointPlan:
        """Begin a reach with a smooth motion that knows of no person yet.

        Args:
            q0: Joint angles (7,) [rad].
            qd0: Joint velocities (7,) [rad/s].
            goal_position: Tool goal (3,) [m], base frame; the posture is free.
            duration_s: Wanted duration [s]; longer where speed limits ask for it.
            time0_s: Plan clock at the start [s].

        Returns:
            The first plan.

        Raises:
            PlanningError: when the state is unusable or the goal is out of reach or in the table.
        """
        q, qd = np.array(q0, dtype=float), np.array(qd0, dtype=float)
        goal = np.array(goal_position, dtype=float)
        for name, values, size in (("q0", q, 7), ("qd0", qd, 7), ("goal", goal, 3)):
            if values.shape != (size,) or not np.all(np.isfinite(values)):
                raise PlanningError(f"{name} = {values}", expected=f"{size} finite numbers")
        if not self.robot.within_limits(q, 1e-3):
            raise PlanningError("start posture lies outside of the joint limits")
        if not 0.1 <= duration_s <= 60.0:
            raise PlanningError(f"duration {duration_s} s", expected="0.1 to 60 s")
        if self.table is not None:
            lowest = self.table.top + float(self.robot.capsule_radii[2])
            if goal[2] < lowest:
                raise PlanningError(
                    f"goal height {goal[2]:.3f} m puts the hand into the table",
                    expected=f"at least {lowest:.3f} m",
                )
        candidates = ik_candidates(self.robot, goal, q, self._rng, count=32)
        state = (q, qd, np.zeros(7))
        best: tuple[float, FloatArray, float] | None = None
        for posture in candidates:
            shortest = fastest_duration(self.robot, self.config.acceleration_limit, state, posture)
            seconds = max(shortest, duration_s)
            cost = self._first_cost(state, posture, seconds, time0_s, goal)
            cost += 10.0 * (seconds - duration_s)
            if best is None or cost < best[0]:
                best = (cost, posture, seconds)
        assert best is not None
        return self._begin(state, goal, best[1], best[2], time0_s)

    def take_over(self, other: PtompPlanner) -> JointPlan:
        """Begin the reach that another planner has just started: its final posture need not be found again.

        Raises:
            PlanningError: when it has none.
        """
        plan = other._require_plan()
        state = (other._home, plan.qd[0], np.zeros(7))
        return self._begin(state, other._goal, other._posture, other._duration_s, other._start_s)

    def _begin(
        self, state: tuple[FloatArray, FloatArray, FloatArray], goal: FloatArray, posture: FloatArray,
        duration_s: float, time0_s: float,
    ) -> JointPlan:  # fmt: skip
        self._goal, self._posture, self._home = goal, posture, state[0]
        self._start_s, self._duration_s = time0_s, duration_s
        self._arrives = True
        self._posture_changed_s = -np.inf
        self._settled = False
        self._search.forget()
        self.stage = "reaching"
        self.plan = self._quintic_plan(state, posture, duration_s, time0_s)
        return self.plan

    def resync(self, q: FloatArray, qd: FloatArray, time_s: float) -> None:
        """Tell the planner that the controller is somewhere else than the plan says.

        After a stop ramp or a scaled speed, the next plan begins at this state.

        Args:
            q: The controller's angles (7,) [rad].
            qd: Its velocities (7,) [rad/s].
            time_s: Plan clock [s].

        Raises:
            PlanningError: when no reach is active or the state is not finite.
        """
        if self.plan is None:
            raise PlanningError("resync without an active reach", hint="call start first")
        if not (np.all(np.isfinite(q)) and np.all(np.isfinite(qd))):
            raise PlanningError("resync state is not finite")
        limits = self.robot
        state = (
            np.clip(np.array(q, dtype=float), limits.lower, limits.upper),
            np.clip(np.array(qd, dtype=float), -limits.velocity, limits.velocity),
            np.zeros(7),
        )
        shortest = fastest_duration(limits, self.config.acceleration_limit, state, self._posture)
        left = self._start_s + self._duration_s - time_s
        self.plan = self._quintic_plan(state, self._posture, max(shortest, left), time_s)
        self._arrives = True
        if self.stage == "holding" and np.abs(state[0] - self._posture).max() > 1e-3:
            self.stage = "reaching"

    def follow(self, plan: JointPlan) -> None:
        """The robot is on this plan, e.g. on the present one but later, as speed scaling makes it.

        It may be any plan of this reach, also one that waits off the goal.

        Raises:
            PlanningError: when no reach is active.
        """
        self._require_plan()
        self.plan = plan
        self._arrives = self._goal_error(plan) < _AT_GOAL_M
        if self._arrives:
            self._posture = plan.q[-1]

    def snapshot(self) -> PlannerSnapshot:
        """What the next replan starts from; see :meth:`restore`."""
        return PlannerSnapshot(
            self.plan, self.stage, self._posture, self._arrives, self._posture_changed_s,
            self._settled,
        )  # fmt: skip

    def restore(self, snapshot: PlannerSnapshot) -> None:
        """Go back to an earlier state, because the plan made since never took effect."""
        self.plan, self.stage = snapshot.plan, snapshot.stage
        self._posture, self._arrives = snapshot.posture, snapshot.arrives
        self._posture_changed_s = snapshot.posture_changed_s
        self._settled = snapshot.settled

    def finished(self, time_s: float) -> bool:
        """Whether the tool rests at the goal at this time of the plan clock."""
        if self.plan is None or not self._arrives:
            return False
        return self.stage == "holding" or time_s >= self.plan.end_s - 1e-9

    def replan(
        self,
        handover_s: float,
        forecasts: Sequence[HumanForecast],
        *,
        iterations: int | None = None,
        deadline: Callable[[], bool] | None = None,
    ) -> ReplanResult:
        """Optimise the rest of the motion with the newest forecasts.

        A planner that is not interleaved does so once, at the first replan of a reach; afterwards it
        only says what has become of its plan.

        Args:
            handover_s: Plan-clock time at which the new plan takes effect [s].
            forecasts: One for each person (or stacked arms); empty when nobody is tracked.
            iterations: Largest number of optimisation steps, the configured one by default.
            deadline: Polled before each step; true ends the search.

        Raises:
            PlanningError: when no reach is active.
        """
        budget = self.config.iterations if iterations is None else iterations
        present = self._require_plan()
        margin = self._margin(handover_s)
        remaining = max(present.end_s - handover_s, 0.0)
        tail = self.config.hold_horizon if self._arrives else 0.0
        grid = self._grid(handover_s, remaining, max(remaining, 0.2) + tail)
        self._costs.bind(grid.columns_s, self._goal, forecasts, *margin)
        motion = from_plan(present, grid, self._arrives)
        totals, terms, _ = self._costs.evaluate(motion.columns(grid)[None])
        trouble = not self._arrives or float(terms[0, 0] + terms[0, 1]) > TROUBLE
        if trouble:
            grid = self._grid(handover_s, remaining, max(LOOK_S, remaining + tail))
            self._costs.bind(grid.columns_s, self._goal, forecasts, *margin)
            motion = from_plan(present, grid, self._arrives)
            totals = self._costs.evaluate(motion.columns(grid)[None])[0]
        kept = candidate(self.config, motion, float(totals[0]), grid)
        settled = handover_s - self._posture_changed_s >= self.config.posture_hold
        late = self._arrives and remaining > 0.0 and present.end_s > self._nominal_end_s + _LATE_S
        task = Task(
            goal=self._goal,
            posture=self._posture,
            home=self._home,
            present=present,
            settled=settled,
            trouble=trouble,
            late=late,
            forecasts=tuple(forecasts),
        )
        chosen, done = kept, 0
        if not self._settled:
            chosen, done = self._search.run(kept, grid, task, budget, deadline)
            self._settled = not self.config.interleaved
        plan = chosen.motion.to_plan(grid)
        if chosen.motion is not motion and not self._keeps_limits(plan):
            chosen, plan = kept, motion.to_plan(grid)
        if chosen.motion is motion and remaining > 0.0:
            # Unchanged, so keep its own knots: on the grid its end would be late by part of a step.
            plan = present.remaining(handover_s)
        return self._conclude(chosen.motion, plan, grid, handover_s, done)

    @property
    def _nominal_end_s(self) -> float:
        return self._start_s + self._duration_s

    def _require_plan(self) -> JointPlan:
        if self.plan is None:
            raise PlanningError("replan without an active reach", hint="call start first")
        return self.plan

    def _margin(self, time_s: float) -> tuple[float, float]:
        """The margin [m] and kappa in force: full while on time, shrinking while overdue.

        A person who rests near the goal gets ever wider forecasts with time ahead; with full margins
        the robot would wait for ever where a careful way exists.
        """
        overdue = time_s - self._nominal_end_s - _OVERDUE_GRACE_S
        share = min(max(overdue / self.config.margin_patience, 0.0), 1.0)
        config = self.config
        return (
            config.margin + share * (config.margin_min - config.margin),
            config.kappa + share * (config.kappa_min - config.kappa),
        )

    def _grid(self, start_s: float, remaining: float, horizon: float) -> Grid:
        plan = self._require_plan()
        nominal = self._duration_s / self.config.num_timesteps
        nominal = max(nominal, horizon / (MAX_COLUMNS - 8))
        steps = round(remaining / nominal)
        step = remaining / steps if steps > 0 else nominal
        knots = int(np.ceil(horizon / step)) + 1
        state = plan.sample(start_s)
        before = start_s - step * np.array([2.0, 1.0])
        past = plan.sample(before)[0]
        early = before < plan.start_s
        q0, v0 = plan.q[0], plan.qd[0]
        past[early] = q0 + (before[early, None] - plan.start_s) * v0
        return Grid(start_s, step, knots, state, past)

    def _keeps_limits(self, plan: JointPlan) -> bool:
        times = np.linspace(plan.start_s, plan.end_s, 2 * len(plan.time_s))
        q, qd, _ = plan.sample(times)
        fast = np.abs(qd) > np.maximum(self.robot.velocity, np.abs(plan.qd[0]) + 1e-6)
        return bool(self.robot.within_limits(q, 1e-9) and not fast.any())

    def _conclude(
        self, motion: Motion, plan: JointPlan, grid: Grid, handover_s: float, done: int
    ) -> ReplanResult:
        if not self._keeps_limits(plan):
            raise PlanningError(
                "the plan leaves the joint limits", hint="the robot stays on the plan before"
            )
        arrives = motion.arrival is not None
        if arrives:
            if np.abs(plan.q[-1] - self._posture).max() > 1e-9:
                self._posture_changed_s = handover_s
            self._posture = plan.q[-1]
        self._arrives = arrives
        self.plan = plan
        at_goal = arrives and motion.arrival == 0
        self.stage = "holding" if at_goal else ("reaching" if arrives else "waiting")
        _, terms, nearest = self._costs.evaluate(motion.columns(grid)[None])
        clearance = float(nearest[0])
        contact_s = self._first_contact(motion, grid) if clearance < 0.0 else None
        late = plan.end_s - self._nominal_end_s if arrives and not at_goal else 0.0
        reason = ""
        if contact_s is not None:
            reason = f"the forecast touches the plan in {contact_s - handover_s:.2f} s"
        elif not arrives:
            reason = "no safe way to the goal now: waiting clear of the person"
        elif late > _LATE_S:
            reason = f"slowed for the person: arrival {late:.2f} s late"
        return ReplanResult(
            plan=plan,
            stage=self.stage,
            feasible=clearance >= 0.0,
            reason=reason,
            iterations=done,
            cost_terms=dict(zip(TERMS, map(float, terms[0]), strict=True)),
            predicted_clearance_m=clearance if clearance < 100.0 else float("inf"),
            predicted_first_contact_s=contact_s,
            goal_error_m=self._goal_error(plan),
        )

    def _goal_error(self, plan: JointPlan) -> float:
        return float(np.linalg.norm(self.robot.frames(plan.q[-1])[3] - self._goal))

    def _first_contact(self, motion: Motion, grid: Grid) -> float:
        """Plan-clock time of the first contact of a motion that is known to have one [s]."""
        columns = motion.columns(grid)
        touching = self._costs.clearances(columns[None])[0, 2:] < 0.0
        return grid.start_s + int(np.argmax(touching)) * grid.step

    def _quintic_plan(
        self, state: tuple[FloatArray, FloatArray, FloatArray], q_end: FloatArray,
        duration_s: float, time0_s: float,
    ) -> JointPlan:  # fmt: skip
        times = np.linspace(0.0, duration_s, self.config.num_timesteps + 1)
        return JointPlan(time0_s + times, *connect(state, q_end, duration_s, times))

    def _first_cost(
        self, state: tuple[FloatArray, FloatArray, FloatArray], posture: FloatArray,
        duration_s: float, time0_s: float, goal: FloatArray,
    ) -> float:  # fmt: skip
        steps = self.config.num_timesteps
        times = np.linspace(0.0, duration_s, steps + 1)
        q = connect(state, posture, duration_s, times)[0]
        past = state[0] - times[[2, 1], None] * state[1]
        spacing = duration_s / steps
        grid_s = np.asarray(time0_s + spacing * np.arange(-2, steps + 1), dtype=np.float64)
        self._costs.bind(grid_s, goal, [], 0.0)
        columns = np.ascontiguousarray(np.concatenate((past, q)).T)
        return float(self._costs.evaluate(columns[None])[0][0])
