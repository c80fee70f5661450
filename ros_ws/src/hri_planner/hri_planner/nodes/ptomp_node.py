"""PTOMP node: replans the arm around the predicted person, one plan an interval."""

from __future__ import annotations

import sys
from typing import Any

from hri_planner.adaptation.origin import unfit
from hri_planner.nodes.motion_node import TICK_S, MotionNode
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.nodes.replanning import Replanning
from hri_planner.nodes.reporting import Reporting
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.interaction import doubts_about
from hri_planner.ptomp.variants import find_variant
from hri_planner.ros.bodies import Bodies
from hri_planner.ros.inputs import Inputs
from hri_planner.warm import warm_kernels
from hri_prediction.ros.messages import IdsList, ReachTarget
from hri_prediction.ros.node import run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LISTS
from hri_prediction.ros.tracked import TRACKED
from hri_prediction.tracked_lists import TrackedLists


class PtompNode(MotionNode):
    """Serves ``/ptomp/reach_target`` and keeps the robot clear of people while it moves."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("ptomp", **kwargs)
        self._config = config = declare_config(self, PtompNodeConfig)
        planner = declare_config(
            self, PtompConfig, prefix="planner", defaults=find_variant(config.variant).config
        )
        inputs = Inputs(radii=config.radii, lists=TrackedLists(config.max_list_age))
        self.replanning = Replanning(
            self._robot,
            config,
            planner,
            inputs,
            tick_s=TICK_S,
            lockstep=self.lockstep,
            now_ns=self.now_ns,
        )
        if config.adaptation_model and (why := unfit(config.adaptation_model, config.variant)):
            self.get_logger().warning(f"{why}: it is used all the same")
        for why in doubts_about(planner.interaction_costs, planner.interaction_file):
            self.get_logger().warning(f"interaction_costs: {why}; they are used all the same")
        warm_kernels()
        reporting = Reporting(self, self._robot, inputs, config.default_duration)
        self.serve_motions(
            config, inputs, self.replanning, reporting, plans_once=not planner.interleaved
        )
        self.listen(IdsList, TRACKED, Bodies(self, inputs).take, LISTS)

    def duration_of(self, request: ReachTarget.Goal) -> float:
        """That of the goal, or the default [s]."""
        return float(request.duration) or self._config.default_duration

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """That of a motion node, with the size of the present planner's problem."""
        level, summary, figures = super().health()
        size = self.replanning.planner.config
        sizes = {"num_timesteps": size.num_timesteps, "num_rollouts": size.num_rollouts}
        return level, summary, sizes | figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    # Optimiser and executor share the interpreter: hand it over often, or callbacks wait 5 ms for it.
    sys.setswitchinterval(5e-4)
    return run_node(PtompNode, args)
