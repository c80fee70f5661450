"""The whole graph of a scenario in lock-step, with the parameters of a launched run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.parameter import Parameter
from std_msgs.msg import Header

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_planner.nodes.policy_node import PolicyNode
from hri_planner.nodes.ptomp_node import PtompNode
from hri_planner.nodes.separation_monitor_node import SeparationMonitorNode
from hri_prediction.errors import ConfigError
from hri_prediction.nodes.predictor_node import PredictorNode
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import Cue, ReachTarget
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import seconds_to_ns, to_time
from hri_sim.launch.run import RunOptions, node_specs
from hri_sim.launch.separation import MONITOR, OFF
from hri_sim.nodes.person_node import PersonNode
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.scenario.schema import Scenario, save_scenario
from hri_sim.testing.graph import Graph, NodeFactory, ReachHandle

NODES: dict[str, type[HriNode]] = {
    "person": PersonNode,
    "predictor": PredictorNode,
    "ptomp": PtompNode,
    "simulator": SimulatorNode,
}
"""Nodes of the graph with a planner, in ticking order: sources before sinks."""

POLICY_NODES: dict[str, type[HriNode]] = {
    "person": PersonNode,
    "policy": PolicyNode,
    "simulator": SimulatorNode,
}
"""The same with a policy."""


def node_factory(
    make: Any,
    *arguments: Any,
    parameters: Mapping[str, Any] | None = None,
    remappings: Mapping[str, str] | None = None,
) -> NodeFactory:
    """A factory for :class:`Graph` with ROS parameters and remappings.

    Args:
        make: Node class, or any callable that takes the arguments of a ROS node.
        arguments: Its own positional arguments.
        parameters: Values by name; others keep their defaults.
        remappings: Topic names by those in the code, as ``-r from:=to`` on a command line.
    """
    rules = [word for old, new in (remappings or {}).items() for word in ("-r", f"{old}:={new}")]
    overrides = [Parameter(name, value=value) for name, value in (parameters or {}).items()]
    return partial(
        make,
        *arguments,
        parameter_overrides=overrides,
        cli_args=["--ros-args", *rules] if rules else None,
    )


def ptomp_graph(
    scenario: Scenario,
    folder: Path,
    *,
    seed: int = 0,
    library: Path | None = None,
    separation: str = OFF,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    remappings: Mapping[str, Mapping[str, str]] | None = None,
    sensors: Sequence[NodeFactory] = (),
    others: Sequence[NodeFactory] = (),
    **graph: Any,
) -> Graph:
    """Person, predictor, planner and simulator of a scenario, ready to run in lock-step.

        with ptomp_graph(draw_scenario(100), tmp_path, seed=100) as graph:
            graph.run(0.5)
            cue(graph, scenario, 0)
            handle = reach(graph, scenario, 0)
            graph.run_until(lambda: handle.done, timeout_s=10.0)

    Args:
        scenario: Scene, people and reaches.
        folder: Where the scenario file goes.
        seed: Seed of people, simulator and planner.
        library: Task library of the predictor; none: constant velocity.
        separation: What a separation monitor reckons with, as for launched runs; ``off``: there is none.
        parameters: Further parameters by node name.
        remappings: Topic remappings by node name.
        sensors: Further nodes that tick after the person and before the predictor.
        others: Further nodes that tick last.
        graph: Further arguments of :class:`Graph`.

    Raises:
        ConfigError: when ``parameters`` or ``remappings`` name a node that is not in the graph.
    """
    return _graph(
        NODES,
        RunOptions(out=folder, seed=seed, separation=separation),
        scenario,
        library=library,
        parameters=parameters or {},
        remappings=remappings or {},
        sensors=sensors,
        others=others,
        **graph,
    )


def policy_graph(
    scenario: Scenario,
    folder: Path,
    *,
    policy: str = DEFAULT_POLICY,
    seed: int = 0,
    separation: str = OFF,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    remappings: Mapping[str, Mapping[str, str]] | None = None,
    sensors: Sequence[NodeFactory] = (),
    others: Sequence[NodeFactory] = (),
    **graph: Any,
) -> Graph:
    """Person, policy and simulator of a scenario, ready to run in lock-step.

    Args:
        scenario: Scene, people and reaches.
        folder: Where the scenario file goes.
        policy: What moves the robot: a file, or a policy that ships.
        seed: Seed of people and simulator.
        separation: What a separation monitor reckons with, as for launched runs; ``off``: there is none.
        parameters: Further parameters by node name.
        remappings: Topic remappings by node name.
        sensors: Further nodes that tick after the person and before the policy.
        others: Further nodes that tick last.
        graph: Further arguments of :class:`Graph`.

    Raises:
        ConfigError: when the policy is unknown, or ``parameters`` or ``remappings`` name a node that is
            not in the graph.
    """
    return _graph(
        POLICY_NODES,
        RunOptions(out=folder, seed=seed, policy=policy, separation=separation),
        scenario,
        library=None,
        parameters=parameters or {},
        remappings=remappings or {},
        sensors=sensors,
        others=others,
        **graph,
    )


def _graph(
    nodes: Mapping[str, type[HriNode]],
    options: RunOptions,
    scenario: Scenario,
    *,
    library: Path | None,
    parameters: Mapping[str, Mapping[str, Any]],
    remappings: Mapping[str, Mapping[str, str]],
    sensors: Sequence[NodeFactory],
    others: Sequence[NodeFactory],
    **graph: Any,
) -> Graph:
    if options.separation != OFF:
        nodes = {**nodes, MONITOR: SeparationMonitorNode}
    for name in {*parameters, *remappings} - nodes.keys():
        raise ConfigError(f"no node {name!r} in this graph", expected=", ".join(nodes))
    path = options.out / "scenario.yaml"
    save_scenario(path, scenario)
    specs = {
        spec.label: spec
        for spec in node_specs(options, scenario, path, library, None, options.out / "bag")
    }
    made = {
        name: node_factory(
            node,
            parameters={**specs[name].parameters, **parameters.get(name, {})},
            remappings=remappings.get(name),
        )
        for name, node in nodes.items()
        if name != "person" or scenario.persons
    }
    sources = [made.pop("person")] if "person" in made else []
    return Graph([*sources, *sensors, *made.values(), *others], **graph)


def cue(graph: Graph, scenario: Scenario, index: int) -> None:
    """Let the person of a reach begin it now, after its delay."""
    reach_spec = scenario.reaches[index]
    message = Cue(
        header=Header(stamp=to_time(seconds_to_ns(graph.now_s)), frame_id=WORLD),
        reach=index,
        person_target=reach_spec.person_target or "",
        delay=reach_spec.person_delay,
        duration=reach_spec.person_duration,
    )
    graph.publish(Cue, "sim/cue", message, reliable(10))


def reach(
    graph: Graph, scenario: Scenario, index: int, action: str = "/ptomp/reach_target"
) -> ReachHandle:
    """Send the robot's goal of a reach."""
    reach_spec = scenario.reaches[index]
    goal = ReachTarget.Goal(target=reach_spec.robot_target, duration=reach_spec.duration)
    return graph.reach(goal, action)
