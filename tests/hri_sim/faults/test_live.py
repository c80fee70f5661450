"""When a node that was killed is back, and when all nodes are well again; without processes."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from hri_prediction.errors import GraphError
from hri_prediction.ros.diagnostics import OK, WARN
from hri_prediction.ros.time import NANO, to_time
from hri_sim.faults import live
from hri_sim.faults.live import LiveGraph
from hri_sim.launch.deaths import RESTART, Deaths
from hri_sim.launch.health import GraphHealth

LABELS = ("person", "predictor")
BEGIN_S = 1000.0


class Server:
    """Of goals."""

    def server_is_ready(self) -> bool:
        return True


class Nodes:
    """A supervisor of nodes that nobody started."""

    labels = LABELS
    pids: dict[str, int] = dict.fromkeys(LABELS, 1)

    def deaths(self) -> list[object]:
        return []


class Heard(LiveGraph):
    """Hears what the test says, in its time."""

    def __init__(self, says: list[tuple[float, str, bytes]]) -> None:
        self.supervisor = Nodes()  # type: ignore[assignment]
        self.told, self.late = [], ""
        self._last, self._spoke_s = {}, {}
        self._deaths = Deaths(self.supervisor, self._tell, RESTART)
        self._health = GraphHealth(self._tell)
        self._client, self._vital = Server(), []
        self.reasons, self._speak = [], []
        self.says, self.now = says, ""
        self.also: list[KeyValue] = []

    def say(self, stamp_s: float, label: str, level: bytes = OK, up_s: float = 0.0) -> None:
        values = [KeyValue(key="up_s", value=f"{up_s:.3f}"), *self.also]
        if level != OK and self.now:
            values.append(KeyValue(key="level_now", value=self.now))
        status = DiagnosticStatus(level=level, hardware_id=label, message="so", values=values)
        header = Header(stamp=to_time(round(stamp_s * NANO)))
        self._on_diagnostics(DiagnosticArray(header=header, status=[status]))

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        while self.says:
            stamp_s, label, level = self.says.pop(0)
            self.say(stamp_s, label, level)
            if until():
                return True
        return False


def test_a_node_is_back_when_it_ticked_again_not_when_that_was_heard() -> None:
    graph = Heard([])
    graph.say(BEGIN_S + 0.01, "person", up_s=20.0)  # of the one that is about to be ended
    assert graph.back_s("person", BEGIN_S) == math.inf
    graph.say(BEGIN_S + 0.9, "predictor", up_s=0.4)
    graph.say(BEGIN_S + 1.2, "person", up_s=0.5)
    graph.say(BEGIN_S + 1.4, "person", up_s=0.7)
    assert graph.back_s("person", BEGIN_S) == pytest.approx(BEGIN_S + 0.7)


def test_all_nodes_must_say_at_the_same_time_that_they_are_well() -> None:
    says = [
        (0.0, "person", OK),
        (0.1, "predictor", WARN),
        (1.0, "person", WARN),
        (1.1, "predictor", OK),
        (2.0, "person", OK),
        (3.0, "person", OK),
    ]
    graph = Heard(says)
    graph.wait_ready()
    assert [stamp_s for stamp_s, _, _ in says] == [3.0]  # the rest was not waited for


def test_a_fault_that_is_over_is_not_waited_for() -> None:
    for now, waited_for in (("1", True), ("0", False)):
        graph = Heard([(1.0, "person", OK), (1.1, "predictor", WARN)])
        graph.now = now
        if waited_for:
            with pytest.raises(GraphError, match="predictor"):
                graph.wait_ready()
        else:
            graph.wait_ready()


@pytest.mark.parametrize(("controller", "ready"), [("stopping", True), ("tracking", False)])
def test_the_simulator_must_be_well_but_for_a_motion_that_was_broken_off(
    monkeypatch: pytest.MonkeyPatch, controller: str, ready: bool
) -> None:
    monkeypatch.setattr(Nodes, "labels", ("simulator", "person"))
    graph = Heard([(1.0, "simulator", WARN), (1.1, "person", OK)])
    graph.also = [KeyValue(key="controller", value=controller)]
    if ready:
        graph.wait_ready()
    else:
        with pytest.raises(GraphError, match="simulator"):
            graph.wait_ready()


def test_what_was_said_before_does_not_count() -> None:
    graph = Heard([(1.0, "predictor", OK)])
    graph.say(0.0, "person")
    with pytest.raises(GraphError, match=r"not ready after 120 s: person \(person: so\)"):
        graph.wait_ready()
    assert graph.late == f"not well again within {live.SLOW_S:.0f} s: person (person: so)"
