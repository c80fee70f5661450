"""PTOMP: progressive trajectory optimisation around where a person will be (chapter 6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.around import WayAround
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import CostModel, TableBox
from hri_planner.ptomp.detour import detour_motions, retreat_motions
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.kernel import FIRST_FREE, ROW, TERMS
from hri_planner.ptomp.motion import Grid, Motion, from_plan
from hri_planner.ptomp.optimizer import Optimizer
from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.ptomp.posture import posture_motions
from hri_planner.ptomp.timing import (
    direct_motions,
    fastest_duration,
    slowed_motions,
    stop_motion,
)
from hri_planner.robot.ik import ik_candidates, newton_to_position
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

STAGES = ("idle", "reaching", "waiting", "holding")

_TROUBLE = 0.02  # collision and contact cost from which alternatives are worth looking at
_LOOK_S = 2.2  # alternatives may arrive so late; with the tail, the longest horizon there is
_WAIT_COST = 0.3  # cost of not arriving at all, so that creeping about the goal never pays
_KEEP = 0.95  # an alternative must cost less than this share of the present plan
_GOAL_TOLERANCE = 1e-7  # m
_OVERDUE_GRACE_S = 0.3
_ROUND_SHARE = 4  # first round: each start gets 1/4 of the iterations
_TRIED = 2  # kinds of motions tried in trouble, besides the way around


@dataclass(frozen=True)
class ReplanResult:
    """What a replan decided.

    Attributes:
        plan: Takes effect at the hand-over, starts at the state the old plan has there.
        stage: reaching, waiting (resting or evading away from the goal) or holding (at the goal).
        feasible: Whether the forecast's mean is nowhere touched and all limits are kept.
        reason: Why the robot is late, waits or is infeasible; empty when all is well.
        iterations: Optimisation steps done.
        cost_terms: Weighted terms of the plan's cost by name.
        predicted_clearance_m: Smallest clearance to the forecast's mean; infinite without people.
        predicted_first_contact_s: First plan-clock time at which the forecast touches the plan.
        goal_error_m: Distance of the tool from the goal at the end of the plan.
        time_scale: Asked duration / duration of the plan as it stands, at most 1.
    """

    plan: JointPlan
    stage: str
    feasible: bool
    reason: str
    iterations: int
    cost_terms: dict[str, float]
    predicted_clearance_m: float
    predicted_first_contact_s: float | None
    goal_error_m: float
    time_scale: float


@dataclass(frozen=True)
class PlannerSnapshot:
    """State of a planner between two replans; opaque to callers."""

    plan: JointPlan | None
    stage: str
    posture: FloatArray
    arrives: bool
    posture_changed_s: float


@dataclass
class _Candidate:
    motion: Motion
    cost: float

    @property
    def rank(self) -> float:
        """Cost by which motions are chosen."""
        return self.cost + (_WAIT_COST if self.motion.arrival is None else 0.0)


class PtompPlanner:
    """Plans one reach at a time and replans it while it runs.

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
        self._optimizer = Optimizer(config, rng)
        self._around = WayAround(robot, config.acceleration_limit, rng)
        self.stage = "idle"
        self.plan: JointPlan | None = None
        self._goal = np.zeros(3)
        self._posture = np.zeros(7)
        self._home = np.zeros(7)
        self._start_s = 0.0
        self._duration_s = 1.5
        self._arrives = False
        self._posture_changed_s = -np.inf

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
            shortest = fastest_duration(
                self.robot, self.config.acceleration_limit, state, posture
            )
            seconds = max(shortest, duration_s)
            cost = self._first_cost(state, posture, seconds, time0_s, goal)
            cost += 10.0 * (seconds - duration_s)
            if best is None or cost < best[0]:
                best = (cost, posture, seconds)
        assert best is not None
        self._goal, self._posture, self._home = goal, best[1], q
        self._start_s, self._duration_s = time0_s, best[2]
        self._arrives = True
        self._posture_changed_s = -np.inf
        self._around.forget()
        self.stage = "reaching"
        self.plan = self._quintic_plan(state, best[1], best[2], time0_s)
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
        shortest = fastest_duration(
            limits, self.config.acceleration_limit, state, self._posture
        )
        left = self._start_s + self._duration_s - time_s
        self.plan = self._quintic_plan(state, self._posture, max(shortest, left), time_s)
        self._arrives = True
        if self.stage == "holding" and np.abs(state[0] - self._posture).max() > 1e-3:
            self.stage = "reaching"

    def follow(self, plan: JointPlan) -> None:
        """The robot is on this plan, e.g. on the present one but later, as speed scaling makes it.

        Raises:
            PlanningError: when no reach is active.
        """
        self._require_plan()
        self.plan = plan

    def snapshot(self) -> PlannerSnapshot:
        """What the next replan starts from; see :meth:`restore`."""
        return PlannerSnapshot(
            self.plan, self.stage, self._posture, self._arrives, self._posture_changed_s
        )

    def restore(self, snapshot: PlannerSnapshot) -> None:
        """Go back to an earlier state, because the plan made since never took effect."""
        self.plan, self.stage = snapshot.plan, snapshot.stage
        self._posture, self._arrives = snapshot.posture, snapshot.arrives
        self._posture_changed_s = snapshot.posture_changed_s

    def finished(self, time_s: float) -> bool:
        """Whether the tool rests at the goal at this time of the plan clock."""
        if self.plan is None or not self._arrives:
            return False
        return self.stage == "holding" or time_s >= self.plan.end_s - 1e-9

    def hold_plan(self, time_s: float, duration_s: float = 0.5) -> JointPlan:
        """A plan that comes to rest as quickly as smoothness allows, then holds.

        Raises:
            PlanningError: when no reach is active.
        """
        grid = self._grid(time_s, 0.0, max(duration_s, 2.0))
        motion = stop_motion(self.robot, self.config.acceleration_limit, grid)
        assert motion is not None
        return motion.to_plan(grid)

    def replan(
        self,
        handover_s: float,
        forecasts: Sequence[HumanForecast],
        *,
        iterations: int | None = None,
        deadline: Callable[[], bool] | None = None,
    ) -> ReplanResult:
        """Optimise the rest of the motion with the newest forecasts.

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
        self._costs.bind(grid.columns_s, self._goal, forecasts, margin)
        kept = _Candidate(from_plan(present, grid, self._arrives), 0.0)
        totals, terms, _ = self._costs.evaluate(kept.motion.columns(grid)[None])
        kept.cost = float(totals[0])
        trouble = not self._arrives or float(terms[0, 0] + terms[0, 1]) > _TROUBLE
        if trouble:
            grid = self._grid(handover_s, remaining, max(_LOOK_S, remaining + tail))
            self._costs.bind(grid.columns_s, self._goal, forecasts, margin)
            kept = _Candidate(from_plan(present, grid, self._arrives), 0.0)
            kept.cost = float(self._costs.evaluate(kept.motion.columns(grid)[None])[0][0])
        starts = self._starts(kept, grid, forecasts, trouble)
        chosen, done = self._search(starts, grid, budget, trouble, deadline)
        plan = chosen.motion.to_plan(grid)
        if chosen.motion is not kept.motion and not self._keeps_limits(plan):
            chosen, plan = kept, kept.motion.to_plan(grid)
        return self._conclude(chosen.motion, plan, grid, handover_s, done)

    def _require_plan(self) -> JointPlan:
        if self.plan is None:
            raise PlanningError("replan without an active reach", hint="call start first")
        return self.plan

    def _margin(self, time_s: float) -> float:
        """The margin in force: full while on time, shrinking while overdue."""
        overdue = time_s - self._start_s - self._duration_s - _OVERDUE_GRACE_S
        share = min(max(overdue / self.config.margin_patience, 0.0), 1.0)
        return self.config.margin + share * (self.config.margin_min - self.config.margin)

    def _grid(self, start_s: float, remaining: float, horizon: float) -> Grid:
        plan = self._require_plan()
        nominal = self._duration_s / self.config.num_timesteps
        nominal = max(nominal, horizon / (ROW - 8))
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

    def _starts(
        self, kept: _Candidate, grid: Grid, forecasts: Sequence[HumanForecast], trouble: bool
    ) -> list[_Candidate]:
        """The present plan and, where they beat it clearly, others, cheapest first."""
        config, robot = self.config, self.robot
        others: list[Motion] = posture_motions(
            kept.motion, grid, robot, self._goal, config.posture_candidates, self._rng
        )
        if trouble:
            limit = config.acceleration_limit
            for posture in self._goal_postures(kept.motion):
                others += direct_motions(robot, limit, grid, posture)
            others += detour_motions(kept.motion, grid, robot)
            others += retreat_motions(grid, robot, limit, forecasts, self._home)
            if self._arrives and kept.motion.arrival:
                others += slowed_motions(self._require_plan(), grid)
            stop = stop_motion(robot, limit, grid)
            if stop is not None:
                others.append(stop)
            if kept.motion.arrival is not None:
                latest = min(grid.knots - 1, int(_LOOK_S / grid.step))
                if latest > kept.motion.arrival:
                    others.append(replace(kept.motion, kind="excursion", arrival=latest))
        if not others:
            return [kept]
        columns = np.stack([motion.columns(grid) for motion in others])
        totals = self._costs.evaluate(columns)[0]
        settled = grid.start_s - self._posture_changed_s >= config.posture_hold
        posture_share = 1.0 - config.posture_gain * (1.0 if settled else 2.0)
        starts = [kept]
        for motion, total in zip(others, totals, strict=True):
            other = _Candidate(motion, float(total))
            share = posture_share if motion.kind == "posture" else _KEEP
            if kept.motion.arrival is None and motion.arrival is not None:
                share = 1.0
            if other.rank < share * kept.rank or motion.kind == "excursion":
                starts.append(other)
        return sorted(starts, key=lambda start: start.rank)

    def _goal_postures(self, kept: Motion) -> list[FloatArray]:
        """The present final posture and, off the goal, those nearest to where the plan is."""
        postures = [self._posture]
        if kept.arrival is None:
            robot = self.robot
            for q in (kept.q[0], kept.q[-1]):
                posture = q.copy()
                missing = newton_to_position(
                    posture, self._goal, robot.lengths, robot.lower, robot.upper, _GOAL_TOLERANCE
                )
                if missing <= _GOAL_TOLERANCE:
                    postures.append(posture)
        return postures

    def _search(
        self,
        starts: list[_Candidate],
        grid: Grid,
        budget: int,
        trouble: bool,
        deadline: Callable[[], bool] | None,
    ) -> tuple[_Candidate, int]:
        """Optimise the best start; in trouble, first try the best of several kinds."""
        if not trouble:
            self._around.forget()
            return self._improve(starts[0], grid, budget, deadline)
        chosen: list[_Candidate] = []
        for start in starts:
            if all(start.motion.kind != other.motion.kind for other in chosen):
                chosen.append(start)
            if len(chosen) == _TRIED:
                break
        way = self._best_way_around(grid, starts[0].motion)
        if way is not None:
            chosen.append(way)
        done = 0
        for index, start in enumerate(chosen):
            chosen[index], used = self._improve(start, grid, budget // _ROUND_SHARE, deadline)
            done += used
        if way is not None:
            self._around.remember(chosen[-1].motion, grid)
        best = min(chosen, key=lambda start: start.rank)
        best, used = self._improve(best, grid, budget - done, deadline)
        return best, done + used

    def _best_way_around(self, grid: Grid, present: Motion) -> _Candidate | None:
        ways = self._around.proposals(grid, self._goal, present.q[-1])
        if not ways:
            return None
        totals = self._costs.evaluate(np.stack([way.columns(grid) for way in ways]))[0]
        best = int(np.argmin(totals))
        return _Candidate(ways[best], float(totals[best]))

    def _improve(
        self, start: _Candidate, grid: Grid, budget: int, deadline: Callable[[], bool] | None
    ) -> tuple[_Candidate, int]:
        motion = start.motion
        columns = motion.columns(grid)
        free_end = motion.arrival is None
        free_until = columns.shape[1] if motion.arrival is None else 2 + motion.arrival
        share = min((free_until - FIRST_FREE) / self.config.num_timesteps, 1.0)
        result = self._optimizer.run(
            self._costs,
            columns,
            start.cost,
            free_until=free_until,
            free_end=free_end,
            sd=self.config.noise_sd * max(share, 0.0) ** self.config.noise_exponent,
            iterations=budget,
            deadline=deadline,
        )
        if result.cost >= start.cost:
            return start, result.iterations
        moved = motion.moved((result.trajectory - columns)[:, 2:].T, grid.step)
        return _Candidate(moved, result.cost), result.iterations

    def _keeps_limits(self, plan: JointPlan) -> bool:
        times = np.linspace(plan.start_s, plan.end_s, 2 * len(plan.time_s))
        q, qd, _ = plan.sample(times)
        fast = np.abs(qd) > np.maximum(self.robot.velocity, np.abs(plan.qd[0]) + 1e-6)
        return bool(self.robot.within_limits(q, 1e-9) and not fast.any())

    def _conclude(
        self, motion: Motion, plan: JointPlan, grid: Grid, handover_s: float, done: int
    ) -> ReplanResult:
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
        nominal = self._start_s + self._duration_s
        late = plan.end_s - nominal if arrives and not at_goal else 0.0
        reason = ""
        if clearance < 0.0:
            reason = f"the forecast touches the plan in {contact_s - handover_s:.2f} s"
        elif not arrives:
            reason = "no safe way to the goal now: waiting clear of the person"
        elif late > 0.05:
            reason = f"slowed for the person: arrival {late:.2f} s late"
        error = float(np.linalg.norm(self.robot.frames(plan.q[-1])[3] - self._goal))
        taken = self._duration_s + max(late, 0.0)
        return ReplanResult(
            plan=plan,
            stage=self.stage,
            feasible=clearance >= 0.0 and self._keeps_limits(plan),
            reason=reason,
            iterations=done,
            cost_terms=dict(zip(TERMS, map(float, terms[0]), strict=True)),
            predicted_clearance_m=clearance if clearance < 100.0 else float("inf"),
            predicted_first_contact_s=contact_s,
            goal_error_m=error,
            time_scale=self._duration_s / taken,
        )

    def _first_contact(self, motion: Motion, grid: Grid) -> float:
        """Plan-clock time of the first contact of a motion that is known to have one [s]."""
        columns = motion.columns(grid)
        touching = self._costs.clearance_profile(columns)[2:] < 0.0
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
        self._costs.bind(time0_s + spacing * np.arange(-2, steps + 1), goal, [], 0.0)
        columns = np.ascontiguousarray(np.concatenate((past, q)).T)
        return float(self._costs.evaluate(columns[None])[0][0])
