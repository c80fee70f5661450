"""The robot on its way: what it does in one condition, and what becomes of it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from hri_planner.ptomp.plan import JointPlan
from hri_planner.robot import RobotModel, load_robot
from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.in_mujoco import InMujoco
from hri_sim.benchmark.joints import Joints, OnPaper
from hri_sim.benchmark.outcome import HOLD_S, LIMIT_S, Execution, Outcome, measure, resting_at
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.tracking import SAMPLE_RATE_HZ
from hri_sim.scenario.schema import Scenario

STEP_S = 1.0 / SAMPLE_RATE_HZ


PAPER, MUJOCO = "paper", "mujoco"
EXECUTIONS: dict[str, Callable[[Scenario], Joints]] = {PAPER: OnPaper, MUJOCO: InMujoco}
"""Ways to make motions of plans: exactly, or by the simulated controller and robot."""


def check_execution(name: str) -> None:
    """Refuse an unknown way.

    Raises:
        ConfigError: naming those that exist.
    """
    if name not in EXECUTIONS:
        raise ConfigError(f"execution {name}", expected="one of " + ", ".join(EXECUTIONS))


class Run:
    """The robot on its way in one condition: what it did, at 250 Hz.

    Args:
        condition: Scene and goal.
        person: Who truly moves in it.
        plan: What it follows from time 0 on.
        execution: One of `EXECUTIONS`.

    Attributes:
        plan: What it is meant to follow from now on.
        over: Whether the hold at the goal, or the time, has ended.
    """

    def __init__(
        self, condition: Condition, person: SimulatedPerson, plan: JointPlan, execution: str
    ) -> None:
        self.plan = plan
        self.over = False
        self._robot: RobotModel = load_robot()
        self._condition = condition
        self._person = person
        self._joints = EXECUTIONS[execution](condition.scenario)
        self._goal = np.array(condition.robot_goal)
        self._states: list[FloatArray] = []
        self._rows = 0
        self._arrived: int | None = None

    @property
    def followed(self) -> JointPlan:
        """The plan that the robot is really on; it is the one that it was given where all is well."""
        return self._joints.followed(self.plan)

    def until(self, time_s: float) -> None:
        """Follow the plan up to a time, if the run is not over before."""
        limit_s = LIMIT_S if self._arrived is None else self._arrived * STEP_S + HOLD_S
        last = round(limit_s / STEP_S)
        rows = np.arange(self._rows, min(math.ceil(time_s / STEP_S - 1e-9), last + 1))
        states = self._joints.move(self.plan, np.asarray(rows * STEP_S, dtype=float), time_s)
        if len(rows):
            self._states.append(states)
            if self._arrived is None:
                row = resting_at(self._robot, states[0], states[1], self._goal)
                self._arrived = None if row is None else self._rows + row
            self._rows += len(rows)
        self.over = self._rows > last

    def ended(self, replans: int, failures: int, iterations: int) -> tuple[Execution, Outcome]:
        """What it was like: the motions, and what they amount to."""
        q, qd, qdd = np.concatenate(self._states, axis=1)
        last = len(q) if self._arrived is None else self._arrived + round(HOLD_S / STEP_S) + 1
        q, qd, qdd = (np.ascontiguousarray(values[:last]) for values in (q, qd, qdd))
        arm = self._person.truth(np.arange(len(q)) * STEP_S)
        execution = Execution(STEP_S, q, qd, qdd, arm, self._arrived)
        outcome = measure(
            self._robot,
            execution,
            self._goal,
            self._condition.scenario.table,
            replans=replans,
            failures=failures + self._joints.refusals,
            iterations=iterations,
            tracking_error=self._joints.tracking_error,
        )
        return execution, outcome
