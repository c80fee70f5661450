"""Every message with a header says in which frame it is, where that means something."""

from motions import start_reach

from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph

JOINT_SPACE = {"/joint_states", "/joint_trajectory_controller/joint_trajectory"}
"""Messages of other packages, without a frame by their own convention."""


def test_headers_are_stamped_in_the_world(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.3)
    start_reach(graph, scenario)
    graph.run(0.3)
    seen = set()
    for topic in graph.log.keys() - JOINT_SPACE:
        for message in graph.messages(topic)[-1:]:
            if hasattr(message, "header"):
                assert message.header.frame_id == "world", topic
                seen.add(topic)
    assert {"/sim/cue", "/joint_trajectory_controller/reference", "/ptomp/status"} <= seen
