"""What a recording of a run must have from its begin on."""

from __future__ import annotations

from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticStatus

from hri_sim.scenario.schema import Scenario

VITAL_TOPICS = ("sim/state", "joint_states", "joint_trajectory_controller/reference")
PERSON_TOPICS = ("humans/bodies/{}/arm", "sim/bodies/{}/arm")
"""A recorder that does not hear these yet, and those of each person, would miss the begin of the run."""


def vital_topics(scenario: Scenario) -> list[str]:
    """Topics without which a recording of a scenario is none, relative to the conductor's namespace."""
    bodies = [person.id for person in scenario.persons]
    return [*VITAL_TOPICS, *(topic.format(body) for body in bodies for topic in PERSON_TOPICS)]


def hears(recorder: DiagnosticStatus, topics: Sequence[str]) -> bool:
    """Whether a recorder says that it has received messages of all these topics."""
    counts = {item.key: item.value for item in recorder.values}
    return all(counts.get(f"received {topic}", "0") != "0" for topic in topics)
