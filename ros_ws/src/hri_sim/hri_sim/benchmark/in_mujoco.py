"""Plans followed by the simulated robot: MuJoCo's LWR4+ under its trajectory controller.

It is the code that the live simulator runs. A plan reaches the controller in the last millisecond before
it is due, as a trajectory that is stamped with the time of its first point, and is joined as there by a
blend of 20 ms; the robot follows by its motors' torques. Bodies pass through each other, so that
contacts do not hide how deep a collision would have been.
"""

from __future__ import annotations

import math

import numpy as np

from hri_planner.ptomp.plan import JointPlan
from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError
from hri_sim.benchmark.joints import standing
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.simulation import STEP_NS, Simulation
from hri_sim.simulator.trajectory import JointTrajectory

_LAG_S = 1e-6  # a smaller one is rounding


class InMujoco:
    """The simulated robot of a scenario, from time 0 on.

    Args:
        scenario: The scene; nobody's arm is put into it.

    Attributes:
        tracking_error: Largest distance of a joint from the plan so far [rad].
        refusals: Plans that the controller refused.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.tracking_error = 0.0
        self.refusals = 0
        self._simulation = Simulation(scenario, contacts=False)
        self._given: JointPlan | None = None
        self._active = standing(self._simulation.q.copy())
        self._accelerations = np.zeros(7)

    def move(self, plan: JointPlan, times_s: FloatArray, until_s: float) -> FloatArray:
        """What the joints do; see :meth:`hri_sim.benchmark.joints.Joints.move`."""
        if plan is not self._given:
            self._give(plan)
        states = np.empty((3, len(times_s), 7))
        for row, time_s in enumerate(times_s):
            self._step_to(round(time_s * 1e9))
            states[:, row] = self._simulation.q, self._simulation.qd, self._accelerations
            planned = self._followed().sample(float(time_s))[0]
            error = float(np.abs(self._simulation.q - planned).max())
            self.tracking_error = max(self.tracking_error, error)
        self._step_to(math.floor(until_s * 1e9 / STEP_NS + 1e-6) * STEP_NS)
        return states

    def followed(self, plan: JointPlan) -> JointPlan:
        """The plan that the controller is on, as late as its reference is."""
        return self._followed()

    def _followed(self) -> JointPlan:
        controller = self._simulation.controller
        if not controller.active:
            return self._active
        elapsed_s = (self._simulation.time_ns - controller.stamp_ns) * 1e-9
        lag_s = elapsed_s - controller.time_in_trajectory
        return self._active.shifted(lag_s) if lag_s > _LAG_S else self._active

    def _give(self, plan: JointPlan) -> None:
        self._given = plan
        simulation = self._simulation
        trajectory = JointTrajectory(
            round(plan.start_s * 1e9),
            simulation.robot.joint_names,
            plan.time_s - plan.start_s,
            plan.q,
            plan.qd,
            plan.qdd,
        )
        try:
            simulation.controller.accept(trajectory)
        except DataError:
            self.refusals += 1
        else:
            self._active = plan

    def _step_to(self, time_ns: int) -> None:
        simulation = self._simulation
        steps = (time_ns - simulation.time_ns) // STEP_NS
        if steps > 0:
            simulation.step(steps)
            self._accelerations[:] = simulation.data.qacc
