"""One trial without ROS: the robot goes a way, a person reads it and reaches, both at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import PERIOD_S, DmpPolicy
from hri_planner.dmp.runner import DmpRunner
from hri_planner.pibb.costs import Terms, deviation, squared_jerk
from hri_planner.pibb.experiment import Experiment
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.link_bounds import box_clearance
from hri_planner.policy.partner import Partner
from hri_planner.policy.planner import floor_over, limits_of
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_planner.robot.model import RobotModel
from hri_sim.readability.clearance import limb_clearance
from hri_sim.readability.participant import Participant

FloatArray = NDArray[np.float64]

CYCLE = 8
"""Control steps between two looks at the person."""
SEEN_AGE_S = 0.02
"""So old is what the robot knows of the person when it looks [s]."""
LONGEST_S = 12.0
"""A trial that is not over by then never is [s]."""
_ARRIVED_M, _RESTS_M_S = 0.004, 0.02


@dataclass(frozen=True, eq=False)
class TrialRecord:
    """What happened.

    Attributes:
        times: From the robot's start on (n,) [s].
        tool: Shape (n, 3) [m].
        joints: Shape (n, 7) [rad].
        person: Keypoints of the arm (n, 4, 3) [m].
        guess: Goal that the person showed.
        shown_s: When the key was pressed, or the hand began to move [s].
        response_s: J_pred: when the key was pressed, or the hand had arrived [s].
        hand_s: J_dur: how long the hand moved [s]; 0 for a key.
        arrived_s: When the robot had arrived [s].
        from_person: Smallest distance of robot and person [m].
        from_obstacles: Of robot and boxes or table [m].
        missed_m: Distance of the tool from the goal in the end [m].
        fastest: Largest joint speed, as a share of the limits.
        filtered: Share of the time in which the filter changed the motion.
    """

    times: FloatArray
    tool: FloatArray
    joints: FloatArray
    person: FloatArray
    guess: str
    shown_s: float
    response_s: float
    hand_s: float
    arrived_s: float
    from_person: float
    from_obstacles: float
    missed_m: float
    fastest: float
    filtered: float

    @property
    def clearance(self) -> float:
        """Smallest distance of the robot from all else [m]."""
        return min(self.from_person, self.from_obstacles)

    @property
    def counts(self) -> bool:
        """Whether the robot arrived and the person answered; live, a trial is broken off otherwise."""
        return math.isfinite(self.arrived_s) and math.isfinite(self.response_s)

    def terms(self, policy: DmpPolicy, goal: str, indistinct: float) -> Terms:
        """Of its costs, for a policy on the way to a goal, whose ways are so indistinct [1/m]."""
        return Terms(
            tool_jerk=squared_jerk(self.tool, PERIOD_S),
            joint_jerk=squared_jerk(self.joints, PERIOD_S),
            prediction_time=self.response_s,
            task=0.0 if self.guess == goal else 1.0,
            deviation=deviation(self.tool, policy.path(goal)),
            human_duration=self.hand_s,
            indistinct=indistinct,
        )


class Bench:
    """Where trials of an experiment happen.

    Args:
        robot: The robot.
        experiment: What is done.
        config: Of the planner; its field and null space are switched off where the experiment says so.
    """

    def __init__(
        self, robot: RobotModel, experiment: Experiment, config: PolicyConfig | None = None
    ) -> None:
        self.robot, self.experiment = robot, experiment
        self.config = experiment.planner(config or PolicyConfig())
        floor = floor_over(experiment.table, robot, self.config.table_margin)
        self._limits = limits_of(robot, self.config, floor=floor, boxes=experiment.boxes)

    def run(self, policy: DmpPolicy, goal: str, participant: Participant) -> TrialRecord:
        """One trial; the robot begins at rest in the policy's posture, the person at home."""
        runner = DmpRunner(policy, self.config.field, self._limits, PERIOD_S)
        inverse = ToolVelocity(self.robot, self.config.inverse_kinematics, runner.posture)
        target = policy.goals[goal]
        q, qd = policy.posture.copy(), np.zeros(7)
        runner.set_out(inverse.tool(q), target, 0.0)
        hand = runner.begin(inverse.tool(q))
        # Trials of one participant follow each other on one clock.
        origin = max(participant.person.rests_from_s, 0.0) + 1.0
        participant.begin(origin, policy.start, policy.goals)
        tools, joints, speeds = [hand.position[None]], [q[None]], [qd[None]]
        filtered, step, arrived_s, over_s = 0, 0, math.inf, math.inf
        while step * PERIOD_S < min(LONGEST_S, over_s):
            seen = self._partner(participant, origin + step * PERIOD_S)
            moved, hands = runner.move(hand, target, [seen], q, qd, CYCLE, inverse)
            hand, q, qd = hands[-1], moved.q[-1], moved.qd[-1]
            tools.append(moved.position)
            joints.append(moved.q)
            speeds.append(moved.qd)
            filtered += int(moved.filtered.sum())
            for index in range(1, CYCLE, 2):
                time_s = origin + (step + index + 1) * PERIOD_S
                participant.watch(time_s, moved.position[index])
            step += CYCLE
            away = float(np.linalg.norm(hand.position - target))
            there = away < _ARRIVED_M and float(np.linalg.norm(hand.velocity)) < _RESTS_M_S
            if there and not math.isfinite(arrived_s):
                arrived_s = step * PERIOD_S
            shown = self._shown_s(participant)
            if there and math.isfinite(shown) and not math.isfinite(over_s):
                over_s = max(shown - origin, arrived_s) + CYCLE * PERIOD_S
        tool, path = np.concatenate(tools), np.concatenate(joints)
        times = np.arange(len(tool), dtype=np.float64) * PERIOD_S
        person = participant.person.truth(origin + times)
        shown = self._shown_s(participant) - origin
        guess, decision = participant.guess, participant.decision
        began = math.inf if decision is None else decision.shown_s - origin
        participant.go_home(origin + float(times[-1]))
        return TrialRecord(
            times=times,
            tool=tool,
            joints=path,
            person=person,
            guess=guess,
            shown_s=began,
            response_s=shown,
            hand_s=shown - began if self.experiment.response == "hand" else 0.0,
            arrived_s=arrived_s,
            from_person=limb_clearance(self.robot, path, person, self._limits.limb_radii),
            from_obstacles=box_clearance(self.robot, path, self.experiment.solids),
            missed_m=float(np.linalg.norm(tool[-1] - target)),
            fastest=float((np.abs(np.concatenate(speeds)) / self.robot.velocity).max()),
            filtered=filtered / max(step, 1),
        )

    def _shown_s(self, participant: Participant) -> float:
        """When the person's answer is there: a key is pressed, or the hand has arrived [s]."""
        if participant.decision is None:
            return math.inf
        if self.experiment.response == "press":
            return participant.decision.shown_s
        return participant.person.rests_from_s

    def _partner(self, participant: Participant, time_s: float) -> Partner:
        """What the robot knows of the person's arm."""
        then = time_s - SEEN_AGE_S
        before, joints = participant.person.truth(np.array((then - PERIOD_S, then)))
        speeds = (joints - before) / PERIOD_S
        return Partner(joints[-1], speeds[-1], 0.0, joints, speeds).later(SEEN_AGE_S)
