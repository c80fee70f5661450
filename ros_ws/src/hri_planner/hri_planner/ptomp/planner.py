"""PTOMP: progressive trajectory optimisation around where a person will be (chapter 6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.conclusion import LATE_S, conclude, keeps_limits
from hri_planner.ptomp.config import LOOK_S, PtompConfig
from hri_planner.ptomp.costs import CostModel, TableBox
from hri_planner.ptomp.first_motion import check_reach, first_posture, smooth_plan
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.horizon import margin_in_force, replan_grid
from hri_planner.ptomp.motion import Grid, Motion, State, from_plan
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.result import ReplanResult
from hri_planner.ptomp.search import MotionSearch, Task, candidate
from hri_planner.ptomp.timing import fastest_duration
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

STAGES = ("idle", "reaching", "waiting", "holding")

_AT_GOAL_M = 1e-4  # plans that arrive end nearer to the goal than this


@dataclass(frozen=True)
class PlannerSnapshot:
    """State of a planner between two replans; opaque to callers."""

    plan: JointPlan | None
    stage: str
    posture: FloatArray
    arrives: bool
    posture_changed_s: float
    settled: bool
    around: tuple[JointPlan | None, FloatArray]


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
        check_reach(self.robot, self.table, (q, qd), goal, duration_s)
        state = (q, qd, np.zeros(7))
        posture, seconds = first_posture(
            self.robot, self.config, self._costs, self._rng, state, goal, duration_s, time0_s
        )
        return self._begin(state, goal, posture, seconds, time0_s)

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
        self.plan = self._smooth_plan(state, duration_s, time0_s)
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
        self.plan = self._smooth_plan(state, max(shortest, left), time_s)
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
            self._settled, self._search.around.memory,
        )  # fmt: skip

    def restore(self, snapshot: PlannerSnapshot) -> None:
        """Go back to an earlier state, because the plan made since never took effect."""
        self.plan, self.stage = snapshot.plan, snapshot.stage
        self._posture, self._arrives = snapshot.posture, snapshot.arrives
        self._posture_changed_s = snapshot.posture_changed_s
        self._settled = snapshot.settled
        self._search.around.memory = snapshot.around

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
        margin = margin_in_force(self.config, handover_s - self._nominal_end_s)
        remaining = max(present.end_s - handover_s, 0.0)
        tail = self.config.hold_horizon if self._arrives else 0.0
        grid = replan_grid(present, handover_s, self.time_step, max(remaining, 0.2) + tail)
        self._costs.bind(grid.columns_s, self._goal, forecasts, *margin)
        motion = from_plan(present, grid, self._arrives)
        totals, terms, _ = self._costs.evaluate(motion.columns(grid)[None])
        trouble = not self._arrives or float(terms[0, 0] + terms[0, 1]) > self.config.trouble_cost
        if trouble:
            grid = replan_grid(present, handover_s, self.time_step, max(LOOK_S, remaining + tail))
            self._costs.bind(grid.columns_s, self._goal, forecasts, *margin)
            motion = from_plan(present, grid, self._arrives)
            totals = self._costs.evaluate(motion.columns(grid)[None])[0]
        kept = candidate(self.config, motion, float(totals[0]), grid)
        settled = handover_s - self._posture_changed_s >= self.config.posture_hold
        late = self._arrives and remaining > 0.0 and present.end_s > self._nominal_end_s + LATE_S
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
        if chosen.motion is not motion and not keeps_limits(self.robot, plan):
            chosen, plan = kept, motion.to_plan(grid)
        if chosen.motion is motion and remaining > 0.0:
            # Unchanged, so keep its own knots: on the grid its end would be late by part of a step.
            plan = present.remaining(handover_s)
        return self._conclude(chosen.motion, plan, grid, handover_s, done)

    @property
    def time_step(self) -> float:
        """Spacing of the time steps of the present motion [s]."""
        return self._duration_s / self.config.num_timesteps

    def free_steps(self, handover_s: float) -> int:
        """Time steps between a hand-over (plan clock [s]) and the end of the present plan.

        Raises:
            PlanningError: when no reach is active.
        """
        return round(max(self._require_plan().end_s - handover_s, 0.0) / self.time_step)

    @property
    def _nominal_end_s(self) -> float:
        return self._start_s + self._duration_s

    def _require_plan(self) -> JointPlan:
        if self.plan is None:
            raise PlanningError("replan without an active reach", hint="call start first")
        return self.plan

    def _conclude(
        self, motion: Motion, plan: JointPlan, grid: Grid, handover_s: float, done: int
    ) -> ReplanResult:
        if not keeps_limits(self.robot, plan):
            raise PlanningError(
                "the plan leaves the joint limits", hint="the robot stays on the plan before"
            )
        self._arrives = motion.arrival is not None
        if self._arrives:
            if np.abs(plan.q[-1] - self._posture).max() > 1e-9:
                self._posture_changed_s = handover_s
            self._posture = plan.q[-1]
        result = conclude(
            self._costs,
            motion,
            plan,
            grid,
            nominal_end_s=self._nominal_end_s,
            slows=self.config.time_scaling,
            goal_error=self._goal_error(plan),
            iterations=done,
        )
        self.plan, self.stage = plan, result.stage
        return result

    def _goal_error(self, plan: JointPlan) -> float:
        return float(np.linalg.norm(self.robot.frames(plan.q[-1])[3] - self._goal))

    def _smooth_plan(self, state: State, duration_s: float, time0_s: float) -> JointPlan:
        return smooth_plan(state, self._posture, duration_s, time0_s, self.config.num_timesteps)
