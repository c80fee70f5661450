"""From plans to the motion of the joints: what does so, and the simplest, which does just as planned."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hri_planner.ptomp.plan import JointPlan
from hri_prediction.arm.geometry import FloatArray
from hri_sim.scenario.schema import Scenario


def standing(q: FloatArray) -> JointPlan:
    """A plan to stay at a posture (7,) [rad]."""
    return JointPlan(np.zeros(1), q[None], np.zeros((1, 7)), np.zeros((1, 7)))


class Joints(Protocol):
    """What makes a motion of plans.

    Attributes:
        tracking_error: Largest distance of a joint from the plan so far [rad].
        refusals: Plans that were not followed, so that the robot stayed on the one before.
    """

    tracking_error: float
    refusals: int

    def move(self, plan: JointPlan, times_s: FloatArray, until_s: float) -> FloatArray:
        """Angles, velocities and accelerations (3, n, 7) at times (n,) along a plan.

        Args:
            plan: What is to be followed from now on.
            times_s: Increasing, after those before; the last is before ``until_s`` [s].
            until_s: When the next plan may come [s].
        """

    def followed(self, plan: JointPlan) -> JointPlan:
        """The plan that the robot is really on, when it is meant to be on this one."""


class OnPaper:
    """The robot is where the plan says.

    Args:
        scenario: The scene.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.tracking_error = 0.0
        self.refusals = 0

    def move(self, plan: JointPlan, times_s: FloatArray, until_s: float) -> FloatArray:
        """The plan's states; see :meth:`Joints.move`."""
        # The plan begins at the first row, but for rounding.
        return np.stack(plan.sample(np.maximum(times_s, plan.start_s)))

    def followed(self, plan: JointPlan) -> JointPlan:
        """The plan itself."""
        return plan
