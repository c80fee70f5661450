"""An experiment in lock-step: all nodes in this process, as fast as they go, the same every time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from hri_planner.nodes.adaptation_node import AdaptationNode
from hri_planner.nodes.policy_node import PolicyNode
from hri_planner.pibb.storage import load_session
from hri_planner.robot.model import load_robot
from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import AdaptationStatus
from hri_prediction.ros.node import HriNode
from hri_sim.launch.adaptation import (
    AdaptationOptions,
    Conducted,
    adaptation_specs,
    check_folder,
)
from hri_sim.nodes.observer_node import ObserverNode
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.readability.scene import experiment_scenario
from hri_sim.testing.graph import Graph, NodeFactory
from hri_sim.testing.scenes import node_factory

NODES: dict[str, type[HriNode]] = {
    "observer": ObserverNode,
    "adaptation": AdaptationNode,
    "policy": PolicyNode,
    "simulator": SimulatorNode,
}
"""In ticking order: sources before sinks."""
LONGEST_TRIAL_S = 120.0
"""Of the graph's time [s]."""


def adaptation_graph(options: AdaptationOptions, *, others: tuple[NodeFactory, ...] = ()) -> Graph:
    """The nodes of an experiment, ready to run in lock-step; the folder is made if it is not there.

    Args:
        options: What is run; nothing is recorded.
        others: Further nodes, which tick last.

    Raises:
        ConfigError: when the options do not fit.
    """
    check_folder(options)
    options.out.mkdir(parents=True, exist_ok=True)
    scenario = experiment_scenario(
        options.experiment, load_robot(), "person1" if options.human == "simulated" else None
    )
    specs = {spec.label: spec for spec in adaptation_specs(options, scenario, options.out, None)}
    factories = [
        node_factory(node, parameters=specs[name].parameters)
        for name, node in NODES.items()
        if name in specs
    ]
    return Graph([*factories, *others])


def run_in_lockstep(
    options: AdaptationOptions, progress: Callable[[int, int, str], None]
) -> Conducted:
    """Run an experiment, or go on with it.

    Raises:
        ConfigError: when the options do not fit.
        GraphError: when it is given up, or a message does not get through.
    """
    with adaptation_graph(replace(options, human="simulated")) as graph:
        node = graph.nodes["adaptation"]
        assert isinstance(node, AdaptationNode)
        done, begun_s = len(node.session.state.results), graph.now_s
        while node.stage not in (AdaptationStatus.OVER, AdaptationStatus.STOPPED):
            graph.run(0.1)
            results = node.session.state.results
            if len(results) > done:
                done, begun_s = len(results), graph.now_s
                last = results[-1]
                right = "right" if last.guess == last.trial.goal else "wrong"
                note = f"{last.trial.goal}: {right} after {last.terms.prediction_time:.2f} s"
                progress(done, node.session.trials, note)
            if graph.now_s - begun_s > LONGEST_TRIAL_S:
                raise GraphError(f"trial {done} takes more than {LONGEST_TRIAL_S:.0f} s")
        if node.stage == AdaptationStatus.STOPPED:
            raise GraphError(f"the experiment was given up: {'; '.join(node.faults)}")
        between_m = node.between
    return Conducted(load_session(options.trials)[0], between_m)
