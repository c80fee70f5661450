"""Faults come when they are due, and what came of them is noted."""

from __future__ import annotations

import signal
from typing import Any

import numpy as np
import pytest

from hri_prediction.ros.time import to_ns
from hri_sim.launch.soak_faults import Happening, Injector
from hri_sim.scenario.schema import PersonSpec
from hri_sim.soak.faults import Fault, FaultPlan

S = 1_000_000_000


class _Plan(FaultPlan):
    """Faults as they are given."""

    def __init__(self, *faults: Fault) -> None:
        self._faults = list(faults)
        self.asked: list[bool] = []

    def next(self, *, kills: bool = True) -> Fault | None:
        self.asked.append(kills)
        return self._faults.pop(0) if self._faults else None


class _Stand:
    """In place of node, publisher and supervisor."""

    def __init__(self) -> None:
        self.sent: list[Any] = []
        self.signals: list[tuple[str, int]] = []
        self.noted: list[Happening] = []

    def create_publisher(self, *arguments: Any) -> _Stand:
        return self

    def publish(self, message: Any) -> None:
        self.sent.append(message)

    def send(self, label: str, number: int) -> None:
        self.signals.append((label, number))

    def kill(self, label: str) -> None:
        self.send(label, signal.SIGKILL)


@pytest.fixture
def stand() -> _Stand:
    return _Stand()


def injector(stand: _Stand, *faults: Fault, until_s: float = 100.0) -> Injector:
    made = Injector(
        stand,
        PersonSpec(),
        stand,  # type: ignore[arg-type]
        _Plan(*faults),
        stand.noted.append,
        kills_until_s=50.0,
        until_s=until_s,
    )
    made.begin(0.0)
    return made


def turn(own: Injector, now_s: float, motion_s: float | None = 1.0, **facts: bool) -> Fault | None:
    return own.turn(now_s, round(now_s * S), motion_s, **{"moving": True, "well": True, **facts})


KILL = Fault("kill", "ptomp", 2.0, 0.5, 0.0)
PAUSE = Fault("pause", "person", 1.0, 0.5, 2.0)
NAN = Fault("nan", "", 1.0, 0.0, 0.1)
CANCEL = Fault("cancel", "", 1.0, 0.0, 0.0)


def test_a_fault_waits_for_its_time_a_motion_and_a_whole_graph(stand: _Stand) -> None:
    own = injector(stand, KILL)
    turn(own, 1.9)
    turn(own, 2.1, None)
    turn(own, 2.2, 0.4)
    turn(own, 2.3, well=False)
    assert stand.signals == []
    turn(own, 2.4)
    assert stand.signals == [("ptomp", signal.SIGKILL)]
    assert not own.died("person")
    assert own.died("ptomp")
    assert not own.died("ptomp")  # that one nobody asked for
    own.told("node person was ended by SIGKILL; it is started again", 2.42)
    own.told("the robot rests because of it", 2.43)
    own.told("node ptomp was ended by SIGKILL; it is started again", 2.45)
    own.told("node ptomp was ended by SIGKILL; it is started again", 3.0)
    own.joints(round(2.5 * S), 0.0)
    own.joints(round(2.55 * S), 0.0)
    own.reach_over("interrupted", 2.5)
    own.reach_over("reached", 7.0)
    turn(own, 7.1)
    assert stand.noted == []  # not all nodes are ready yet
    own.ready(8.0)
    turn(own, 8.1)
    (found,) = [happening.to_mapping() for happening in stand.noted]
    assert found["rest_ms"] == pytest.approx(100.0)
    assert found["named_ms"] == pytest.approx(50.0)
    assert (found["ready_s"], found["reached_s"]) == (5.6, 4.6)
    assert found["outcomes"] == ["interrupted", "reached"]
    turn(own, 30.0)  # and there is no other
    assert len(stand.signals) == 1


def test_a_node_stands_still_for_a_while(stand: _Stand) -> None:
    own = injector(stand, PAUSE)
    turn(own, 1.1)
    assert stand.signals == [("person", signal.SIGSTOP)]
    own.reach_over("reached", 2.0)  # a goal that is reached meanwhile does not count
    turn(own, 3.0)
    assert len(stand.signals) == 1
    turn(own, 3.2)
    assert stand.signals[1:] == [("person", signal.SIGCONT)]
    own.reach_over("reached", 6.1)
    turn(own, 6.2)
    assert stand.noted[0].reached_s == 5.0


def test_nothing_stands_still_when_it_is_over(stand: _Stand) -> None:
    own = injector(stand, PAUSE)
    turn(own, 1.1)
    own.end(1.5)
    own.end(1.6)
    assert stand.signals[-1] == ("person", signal.SIGCONT)
    assert [happening.reached_s for happening in stand.noted] == [None]


@pytest.mark.parametrize("kind", ["nan", "frame", "clock", "jump"])
def test_motion_capture_goes_mad(stand: _Stand, kind: str) -> None:
    own = injector(stand, Fault(kind, "", 1.0, 0.0, 0.1))
    for now_s in np.arange(1.1, 1.4, 0.005):
        turn(own, float(now_s))
    assert 4 <= len(stand.sent) <= 6
    message = stand.sent[0]
    points = np.array(message.keypoints)
    assert np.isnan(points).all() == (kind == "nan")
    assert (message.header.frame_id != "world") == (kind == "frame")
    assert (to_ns(message.header.stamp) < S) == (kind == "clock")
    home = np.array(PersonSpec().home)
    assert (np.abs(points[9:] - home).max() > 0.4) == (kind == "jump")


@pytest.mark.parametrize(
    ("kind", "outcomes", "wanted"),
    [
        ("cancel", ("cancelled",), True),
        ("cancel", ("reached",), True),
        ("cancel", ("failed",), False),
        ("preempt", ("preempted", "reached"), True),
        ("preempt", ("preempted", "blocked"), False),
        ("preempt", ("preempted",), False),
        ("unreachable", ("preempted", "unreachable"), True),
        ("unreachable", ("lost_input", "unreachable"), True),
        ("unreachable", ("interrupted", "preempted"), False),
    ],
)
def test_goals_end_as_they_should(
    stand: _Stand, kind: str, outcomes: tuple[str, ...], wanted: bool
) -> None:
    own = injector(stand, Fault(kind, "", 1.0, 0.0, 0.0))
    assert turn(own, 0.5) is None
    fault = turn(own, 1.1)
    assert fault is not None
    assert fault.kind == kind
    own.goals_ended(*outcomes)
    own.reach_over("reached", 4.0)
    turn(own, 4.1)
    assert stand.noted[0].as_wanted is wanted


def test_late_in_a_run_nobody_is_killed_and_at_its_end_nothing_comes(stand: _Stand) -> None:
    plan = _Plan(KILL, NAN)
    own = Injector(
        stand,
        PersonSpec(),
        stand,  # type: ignore[arg-type]
        plan,
        stand.noted.append,
        kills_until_s=50.0,
        until_s=60.0,
    )
    turn(own, 55.0)
    assert stand.signals == []
    assert plan.asked == [True, False]  # another one takes its place
    turn(own, 61.0)
    assert own.happening is None
