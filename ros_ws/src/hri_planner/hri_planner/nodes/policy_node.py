"""Policy node: moves the tool as a policy says, a network learnt from people or movement primitives.

Each cycle the policy goes on from where the robot will be, with what motion capture says of the
partner; its acceleration is filtered so that the set separation is kept, and the joints follow
(:mod:`hri_planner.policy`).
"""

from __future__ import annotations

import sys
from typing import Any

from geometry_msgs.msg import PoseStamped

from hri_planner.dmp.policy import HOME, DmpPolicy
from hri_planner.nodes.motion_node import TICK_S, MotionNode
from hri_planner.nodes.policy_config import PolicyNodeConfig
from hri_planner.nodes.policy_replanning import PolicyReplanning
from hri_planner.nodes.policy_reporting import PolicyReporting
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.model_file import find_any, load_any
from hri_planner.policy.planner import AnyPolicy
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ros.arms import ArmInputs, Arms
from hri_planner.ros.conversions import end_message
from hri_planner.ros.goals import moving_position_of
from hri_planner.warm import warm_kernels
from hri_prediction.errors import HriError, PlanningError
from hri_prediction.ros.messages import IdsList, LoadModel, ReachTarget
from hri_prediction.ros.node import run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS, reliable
from hri_prediction.ros.tracked import TRACKED
from hri_prediction.tracked_lists import TrackedLists

LAST_PLAN_S = 0.02
"""A plan that is made when its motion ends is given so long [s]; it takes milliseconds."""


class PolicyNode(MotionNode):
    """Serves ``/policy/reach_target``; ``/policy/goal`` moves the goal of the present motion."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("policy", **kwargs)
        config = self._config = declare_config(self, PolicyNodeConfig)
        policy = declare_config(self, PolicyConfig, prefix="policy_planner")
        inputs = ArmInputs(radii=config.radii, lists=TrackedLists(config.max_list_age))
        self._max_goal_age_s = config.max_goal_age
        self._held: JointPlan | None = None
        model = load_any(find_any(config.policy))
        self.replanning = PolicyReplanning(
            self._robot,
            model,
            config,
            policy,
            inputs,
            tick_s=TICK_S,
            lockstep=self.lockstep,
            now_ns=self.now_ns,
        )
        warm_kernels()
        self._reporting = PolicyReporting(self, self._robot, inputs, config.policy)
        self.serve_motions(config, inputs, self.replanning, self._reporting)
        self._name_goals(model)
        self.listen(IdsList, TRACKED, Arms(self, inputs, config.max_future).take, LISTS)
        self.listen(PoseStamped, "policy/goal", self._on_moving_goal, reliable(1), command=True)
        self.serve(LoadModel, "~/load_model", self._on_load_model)

    def duration_of(self, request: ReachTarget.Goal) -> float:
        """Networks take the time that they have learnt; movement primitives what is asked for."""
        return float(request.duration)

    def on_tick(self, now_ns: int) -> None:
        """End what held the robot before another policy was loaded, then as any planner's node."""
        if self._held is not None and self._supervisor.motion is None:
            # Else the controller would stop for want of the next plan, and the motion to come would only
            # recover its speed bit by bit.
            self._trajectory.publish(end_message(self._held, self._robot.joint_names))
        self._held = None
        super().on_tick(now_ns)

    def _name_goals(self, model: AnyPolicy) -> None:
        """Let goals name those that the policy knows, where the scene has none of that name."""
        known = {**model.goals, HOME: model.start} if isinstance(model, DmpPolicy) else {}
        self.targets_by_name = {**known, **self._config.targets}

    def _on_moving_goal(self, message: PoseStamped) -> None:
        """Move the goal of the present motion; what is held stays."""
        try:
            target = moving_position_of(message, self.now_ns(), self._max_goal_age_s)
            motion = self._supervisor.motion
            if motion is None or motion.cancelling:
                raise PlanningError(
                    f"a goal on policy/goal, and {'a motion that ends' if motion else 'no motion'}",
                    hint="it moves the goal of a motion: begin one with policy/reach_target",
                )
            self.replanning.retarget(target)
        except PlanningError as error:
            self.fault("goal", str(error))
            return
        self._supervisor.retarget(target)

    def _on_load_model(
        self, request: LoadModel.Request, response: LoadModel.Response
    ) -> LoadModel.Response:
        try:
            # A motion may be over while its last plan is still being made.
            if self._supervisor.motion is not None or not self.replanning.worker.wait(LAST_PLAN_S):
                raise PlanningError("a motion is under way", hint="cancel it, or wait for its end")
            model = load_any(find_any(request.path))
            self.replanning.planner.check_model(model)
        except HriError as error:
            response.success, response.message = False, str(error)
            return response
        if self._supervisor.holding:
            # What held the robot ends with its policy: it stands where it is.
            self._carry_out(self.now_ns(), self._supervisor.release("another policy was loaded"))
            self._held = self.replanning.planner.plan
        self.replanning.planner.use(model)
        self._name_goals(model)
        self._reporting.policy = request.path
        response.success, response.message = True, f"{request.path}: {_described(model)}"
        return response


def _described(model: AnyPolicy) -> str:
    """In a few words."""
    if isinstance(model, DmpPolicy):
        return f"movement primitives to {', '.join(model.names)}"
    return f"{model.network.kind} {'x'.join(map(str, model.network.units))}"


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    # Policy and executor share the interpreter: hand it over often, or callbacks wait 5 ms for it.
    sys.setswitchinterval(5e-4)
    return run_node(PolicyNode, args)
