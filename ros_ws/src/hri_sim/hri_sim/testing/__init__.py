"""Test kit: run nodes of this graph, or your own, in one process, in lock-step.

    from hri_sim.testing import Graph

    with Graph([make_simulator, make_person, MyNode]) as graph:
        graph.run(seconds=2.0)
        assert len(graph.log["/joint_states"]) == 500

Each entry is a callable that takes ``context=`` and ``lockstep_ns=`` and returns a
:class:`hri_prediction.ros.node.HriNode`. Same seed, same message sequences, byte for byte.
"""

from hri_sim.testing.graph import Graph
from hri_sim.testing.lockstep import LockStep, TopicLog

__all__ = ["Graph", "LockStep", "TopicLog"]
