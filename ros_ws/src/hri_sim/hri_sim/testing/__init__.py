"""Test kit: run nodes of this graph, or your own, in one process, in lock-step.

    from hri_sim.testing import Graph

    with Graph([make_simulator, make_person, MyNode]) as graph:
        graph.run(seconds=2.0)
        assert len(graph.log["/joint_states"]) == 500

Each entry is a callable that takes ``context=`` and ``lockstep_ns=`` and returns a
:class:`hri_prediction.ros.node.HriNode`. Same seed, same message sequences, byte for byte.
``node_factory`` makes such a callable of a node class with parameters and remappings;
``ptomp_graph`` and ``policy_graph`` are the whole graph of a scenario, with a planner or a policy, into
which a test puts nodes of its own.
"""

from hri_sim.testing.graph import Graph, ReachHandle
from hri_sim.testing.lockstep import LockStep, TopicLog
from hri_sim.testing.scenes import cue, node_factory, policy_graph, ptomp_graph, reach

__all__ = [
    "Graph",
    "LockStep",
    "ReachHandle",
    "TopicLog",
    "cue",
    "node_factory",
    "policy_graph",
    "ptomp_graph",
    "reach",
]
