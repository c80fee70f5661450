"""Hands exactly in the way: whether the tool finds a way around, and touches nothing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import PERIOD_S, DmpPolicy
from hri_planner.dmp.runner import DmpRunner
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.initial import straight_policy
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.partner import Partner
from hri_planner.policy.planner import limits_of
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_planner.robot.model import RobotModel, load_robot
from hri_sim.readability.clearance import limb_clearance
from hri_sim.readability_report.cases import END_EFFECTOR, TEACHER, A

FloatArray = NDArray[np.float64]
Hand = Callable[[float], tuple[FloatArray, FloatArray]]
"""Time [s] to place (3,) [m] and velocity (3,) [m/s]."""

LEAST_WAY_M = 0.35
"""Of shorter ways a hand in the middle would keep the tool from start and goal."""
REACHED_M = 0.004
SECONDS = 7.0
FOREARM_M = 0.3
FOREARM_RADIUS_M = 0.05
SPEED_M_S = 0.25
"""Of hands that come."""
_CYCLE = 8
KINDS = {
    "resting": "rests in the middle of the way",
    "coming": "comes along the way, to its middle",
}


def head_on(smoke: bool) -> list[dict[str, Any]]:
    """What happens on the straight ways of the experiments, with the field and without it."""
    robot, found = load_robot(), []
    for case in (A, TEACHER, END_EFFECTOR):
        experiment = case.experiment(smoke)
        start = robot.frames(experiment.posture)[3]
        for name, goal in experiment.goals.items():
            length = float(np.linalg.norm(goal - start))
            if length < LEAST_WAY_M:
                continue
            for kind in KINDS:
                for field in (True, False):
                    away, gap = meet(robot, experiment, goal, kind, field)
                    found.append(
                        {
                            "experiment": experiment.name,
                            "goal": name,
                            "length_m": length,
                            "hand": kind,
                            "field": field,
                            "missed_m": away,
                            "reached": away <= REACHED_M,
                            "clearance_m": gap,
                        }
                    )
        if smoke:
            break
    return found


def meet(
    robot: RobotModel, experiment: Experiment, goal: FloatArray, kind: str, field: bool
) -> tuple[float, float]:
    """One straight way, on which the hand is the only obstacle.

    Returns:
        Distance from the goal in the end, and the smallest one of robot and forearm [m].
    """
    config = PolicyConfig()
    if not field:
        config = replace(config, field_strength=0.0)
    # The way is straight, whatever stands in it.
    policy = straight_policy(
        robot, experiment.posture, {"goal": goal}, np.empty((0, 2, 3)), experiment.duration
    )
    limits = limits_of(robot, config, floor=None)
    runner = DmpRunner(policy, config.field, limits, PERIOD_S)
    inverse = ToolVelocity(robot, config.inverse_kinematics, runner.posture)
    hand_of, elbow = _hand(policy, goal, kind)
    q, qd = policy.posture.copy(), np.zeros(7)
    runner.set_out(inverse.tool(q), goal, 0.0)
    state = runner.begin(inverse.tool(q))
    joints: list[FloatArray] = []
    people: list[FloatArray] = []
    for step in range(0, round(SECONDS / PERIOD_S), _CYCLE):
        place, velocity = hand_of(step * PERIOD_S)
        arm, speeds = np.stack((place + elbow, place)), np.stack((velocity, velocity))
        partner = Partner(place, velocity, 0.0, arm, speeds)
        moved, states = runner.move(state, goal, [partner], q, qd, _CYCLE, inverse)
        state, q, qd = states[-1], moved.q[-1], moved.qd[-1]
        joints.append(moved.q)
        people.append(_extrapolated(arm, speeds))
    gap = limb_clearance(robot, np.concatenate(joints), np.concatenate(people), [FOREARM_RADIUS_M])
    return float(np.linalg.norm(state.position - goal)), gap


def _hand(policy: DmpPolicy, goal: FloatArray, kind: str) -> tuple[Hand, FloatArray]:
    """The hand's motion, its tip exactly on the way, and where the elbow is from it (3,) [m].

    That is to the side, so that the tip is what is nearest to the tool.
    """
    way = goal - policy.start
    ahead = way / np.linalg.norm(way)
    aside = np.cross((0.0, 0.0, 1.0), ahead)
    half_s = 0.5 * float(np.linalg.norm(way)) / SPEED_M_S

    def hand(time_s: float) -> tuple[FloatArray, FloatArray]:
        if kind == "resting":
            return policy.start + 0.5 * way, np.zeros(3)
        if time_s >= half_s:
            return goal - SPEED_M_S * half_s * ahead, np.zeros(3)
        return goal - SPEED_M_S * time_s * ahead, -SPEED_M_S * ahead

    return hand, FOREARM_M * aside / np.linalg.norm(aside)


def _extrapolated(arm: FloatArray, speeds: FloatArray) -> FloatArray:
    times = PERIOD_S * np.arange(1, _CYCLE + 1)
    return np.asarray(arm + times[:, None, None] * speeds)


def lines(found: Sequence[dict[str, Any]]) -> list[list[str]]:
    """Rows of a table: hand and field, ways, how many are reached, contacts, smallest distance."""
    rows = []
    for kind, said in KINDS.items():
        for field in (True, False):
            some = [one for one in found if one["hand"] == kind and one["field"] == field]
            rows.append(
                [
                    f"a hand {said}",
                    "with" if field else "without",
                    str(len(some)),
                    str(sum(one["reached"] for one in some)),
                    str(sum(one["clearance_m"] <= 0.0 for one in some)),
                    f"{100.0 * min(one['clearance_m'] for one in some):.1f}",
                ]
            )
    return rows
