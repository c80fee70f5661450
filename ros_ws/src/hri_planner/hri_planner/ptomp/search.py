"""One replan's search: gather motions, compare them, optimise the most promising ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.around import WayAround
from hri_planner.ptomp.config import LOOK_S, PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.detour import detour_motions, retreat_motions
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.layout import FIRST_FREE
from hri_planner.ptomp.motion import Grid, Motion
from hri_planner.ptomp.optimizer import Optimizer
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.posture import posture_motions
from hri_planner.ptomp.timing import direct_motions, slowed_motions, stop_motion
from hri_planner.robot.ik import newton_to_position
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_GOAL_TOLERANCE = 1e-7  # m
_ROUND_SHARE = 4  # first round: each start gets 1/4 of the iterations
_POSTURES = 16  # final postures between two looks at the deadline
_TRIED = 2  # kinds of motions tried in trouble, besides the way around


@dataclass(frozen=True)
class Task:
    """What a replan works on.

    Attributes:
        goal: Tool goal (3,) [m].
        posture: Present final posture (7,) [rad].
        home: Posture at the start of the reach (7,) [rad], a place to retreat to.
        present: The plan so far.
        settled: Whether the last change of the final posture is some time ago.
        trouble: Whether the present plan meets a person or does not arrive.
        late: Whether it arrives later than it was asked to.
        forecasts: People.
    """

    goal: FloatArray
    posture: FloatArray
    home: FloatArray
    present: JointPlan
    settled: bool
    trouble: bool
    late: bool
    forecasts: Sequence[HumanForecast]


@dataclass(frozen=True)
class Candidate:
    """A motion and its cost on the bound cost model.

    Attributes:
        motion: The motion.
        cost: Its cost.
        rank: Cost by which motions are chosen: sooner is better, not to arrive is worst.
    """

    motion: Motion
    cost: float
    rank: float


def candidate(config: PtompConfig, motion: Motion, cost: float, grid: Grid) -> Candidate:
    """A motion on a grid with its cost, ranked."""
    arrival = motion.arrival
    later = config.wait_cost if arrival is None else config.late_weight * arrival * grid.step
    return Candidate(motion, cost, cost + later)


class MotionSearch:
    """Finds the motion of one replan.

    Args:
        robot: The robot.
        config: Sizes, noise and thresholds.
        costs: Cost model, bound to the problem before each search.
        rng: Source of all randomness.

    Attributes:
        around: The way around that is remembered from one replan to the next.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: PtompConfig,
        costs: CostModel,
        rng: np.random.Generator,
    ) -> None:
        self._robot = robot
        self._config = config
        self._costs = costs
        self._rng = rng
        self._optimizer = Optimizer(config, rng)
        self.around = WayAround(robot, config.acceleration_limit, rng)

    def forget(self) -> None:
        """Begin a new reach."""
        self.around.forget()

    def run(
        self,
        kept: Candidate,
        grid: Grid,
        task: Task,
        budget: int,
        deadline: Callable[[], bool] | None,
    ) -> tuple[Candidate, int]:
        """The best motion found, and the iterations used.

        Args:
            kept: The present plan on the grid.
            grid: Grid of this replan.
            task: See there.
            budget: Largest number of iterations.
            deadline: Polled before each; true ends the search.
        """
        done = 0
        if task.trouble and kept.motion.arrival is not None:
            # Mostly the plan itself can be mended, and then nothing slower is called for.
            kept, done = self._improve(kept, grid, budget // _ROUND_SHARE, deadline)
            task = replace(task, trouble=self._meets_people(kept.motion, grid))
        starts = self._starts(kept, grid, task, deadline)
        best, used = self._search(starts, grid, task, budget - done, deadline)
        return best, done + used

    def _meets_people(self, motion: Motion, grid: Grid) -> bool:
        terms = self._costs.evaluate(motion.columns(grid)[None])[1]
        return float(terms[0, 0] + terms[0, 1]) > self._config.trouble_cost

    def _starts(
        self, kept: Candidate, grid: Grid, task: Task, deadline: Callable[[], bool] | None
    ) -> list[Candidate]:
        """The present plan and, where they beat it clearly, others, cheapest first."""
        config = self._config
        others: list[Motion] = []
        for motions in self._proposals(kept.motion, grid, task):
            others += motions
            if deadline is not None and deadline():
                break
        latest = max(int(LOOK_S / grid.step), kept.motion.arrival or 0)
        others = [m for m in others if m.arrival is None or m.arrival <= latest]
        if not others:
            return [kept]
        columns = np.stack([motion.columns(grid) for motion in others])
        totals = self._costs.evaluate(columns)[0]
        posture_share = 1.0 - config.posture_gain * (1.0 if task.settled else 2.0)
        starts = [kept]
        for motion, total in zip(others, totals, strict=True):
            other = candidate(config, motion, float(total), grid)
            share = posture_share if motion.kind == "posture" else 1.0 - config.motion_gain
            if kept.motion.arrival is None and motion.arrival is not None:
                share = 1.0
            if other.rank < share * kept.rank or motion.kind == "excursion":
                starts.append(other)
        return sorted(starts, key=lambda start: start.rank)

    def _proposals(self, kept: Motion, grid: Grid, task: Task) -> Iterator[list[Motion]]:
        """Other motions, those first that a robot in trouble can least do without."""
        config, robot = self._config, self._robot
        if config.time_scaling:
            yield from self._other_timings(kept, grid, task)
        if task.trouble and config.ways_around:
            yield detour_motions(kept, grid, robot)
            end = min(grid.knots - 1, int(LOOK_S / grid.step))
            if kept.arrival is not None and end > kept.arrival:
                yield [replace(kept, kind="excursion", arrival=end)]
        for first in range(0, config.posture_candidates, _POSTURES):
            count = min(config.posture_candidates - first, _POSTURES)
            yield posture_motions(kept, grid, robot, task.goal, count, self._rng)

    def _other_timings(self, kept: Motion, grid: Grid, task: Task) -> Iterator[list[Motion]]:
        """Slower, later or stopped motions, fresh ones, and retreats."""
        robot, limit = self._robot, self._config.acceleration_limit
        if task.trouble:
            stop = stop_motion(robot, limit, grid)
            yield [] if stop is None else [stop]
            yield slowed_motions(task.present, grid) if kept.arrival else []
        if task.trouble or task.late:
            for posture in self._goal_postures(kept, task):
                yield direct_motions(robot, limit, grid, posture)
        if task.trouble:
            yield retreat_motions(grid, robot, limit, task.forecasts, task.home)

    def _goal_postures(self, kept: Motion, task: Task) -> list[FloatArray]:
        """The present final posture and, off the goal, those nearest to where the plan is."""
        postures = [task.posture]
        if kept.arrival is None:
            robot = self._robot
            for q in (kept.q[0], kept.q[-1]):
                posture = q.copy()
                missing = newton_to_position(
                    posture, task.goal, robot.lengths, robot.lower, robot.upper, _GOAL_TOLERANCE
                )
                if missing <= _GOAL_TOLERANCE:
                    postures.append(posture)
        return postures

    def _search(
        self,
        starts: list[Candidate],
        grid: Grid,
        task: Task,
        budget: int,
        deadline: Callable[[], bool] | None,
    ) -> tuple[Candidate, int]:
        """Optimise the best start; in trouble, first try the best of several kinds."""
        if not task.trouble:
            self.around.forget()
            return self._improve(starts[0], grid, budget, deadline)
        chosen: list[Candidate] = []
        for start in starts:
            if all(start.motion.kind != other.motion.kind for other in chosen):
                chosen.append(start)
            if len(chosen) == _TRIED:
                break
        way = None
        if self._config.ways_around and (deadline is None or not deadline()):
            way = self._best_way_around(grid, task, starts[0].motion)
        if way is not None:
            chosen.append(way)
        done = 0
        for index, start in enumerate(chosen):
            chosen[index], used = self._improve(start, grid, budget // _ROUND_SHARE, deadline)
            done += used
        if way is not None:
            self.around.remember(chosen[-1].motion, grid)
        best = min(chosen, key=lambda start: start.rank)
        best, used = self._improve(best, grid, budget - done, deadline)
        return best, done + used

    def _best_way_around(self, grid: Grid, task: Task, present: Motion) -> Candidate | None:
        ways = self.around.proposals(grid, task.goal, present.q[-1])
        if not ways:
            return None
        totals = self._costs.evaluate(np.stack([way.columns(grid) for way in ways]))[0]
        best = int(np.argmin(totals))
        return candidate(self._config, ways[best], float(totals[best]), grid)

    def _improve(
        self, start: Candidate, grid: Grid, budget: int, deadline: Callable[[], bool] | None
    ) -> tuple[Candidate, int]:
        motion = start.motion
        columns = motion.columns(grid)
        free_end = motion.arrival is None
        free_until = columns.shape[1] if motion.arrival is None else 2 + motion.arrival
        share = min((free_until - FIRST_FREE) / self._config.num_timesteps, 1.0)
        result = self._optimizer.run(
            self._costs,
            columns,
            start.cost,
            free_until=free_until,
            free_end=free_end,
            sd=self._config.noise_sd * max(share, 0.0) ** self._config.noise_exponent,
            iterations=budget,
            deadline=deadline,
        )
        if result.cost >= start.cost:
            return start, result.iterations
        moved = motion.moved((result.trajectory - columns)[:, 2:].T, grid.step)
        return candidate(self._config, moved, result.cost, grid), result.iterations
