"""The conductor's part that needs no other process."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticStatus

from hri_planner.supervision.touch import TOUCHED
from hri_prediction.ros.messages import PlannerStatus, SimState
from hri_prediction.ros.time import NANO
from hri_sim.launch.conductor import Conductor
from hri_sim.launch.deaths import RESTART
from hri_sim.launch.held_signals import EndingSignals, HeldSignals
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.launch.vital import vital_topics
from hri_sim.scenario.shipped import load_shipped

SCENARIO = load_shipped("table_reach")


@pytest.fixture
def said() -> list[str]:
    return []


@pytest.fixture
def conductor(
    tmp_path: Path, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[Conductor]:
    init = rclpy.init

    def in_a_cell(**options: object) -> None:
        init(args=["--ros-args", "-r", "__ns:=/cell"], **options)

    monkeypatch.setattr(rclpy, "init", in_a_cell)
    made = Conductor(SCENARIO, Supervisor(tmp_path), said.append, said.append)
    yield made
    made.close()


def test_a_recording_needs_the_person_in_the_namespace_used(conductor: Conductor) -> None:
    (person,) = SCENARIO.persons
    assert f"humans/bodies/{person.id}/arm" in vital_topics(SCENARIO)
    assert set(conductor._vital) >= {
        "/cell/sim/state",
        "/cell/joint_states",
        f"/cell/humans/bodies/{person.id}/arm",
        f"/cell/sim/bodies/{person.id}/arm",
    }
    nobody = SCENARIO.model_copy(update={"persons": ()})
    assert not [topic for topic in vital_topics(nobody) if "bodies" in topic]


def test_a_node_that_died_is_waited_for_before_it_is_started_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is started a while after its death: meanwhile there is no process that could be missing."""
    path = tmp_path / "lib" / "cell" / "node"
    path.parent.mkdir(parents=True)
    path.write_text(f"#!{sys.executable}\nimport time\ntime.sleep(60)\n")
    path.chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    well = DiagnosticStatus(hardware_id="needed", level=DiagnosticStatus.OK)
    with Supervisor(tmp_path / "run") as nodes:
        made = Conductor(SCENARIO, nodes, lambda text: None, lambda text: None, on_death=RESTART)
        try:
            nodes.start([NodeSpec("cell", "node", name="needed")])
            made._begun = True
            made._health.take([well], time.monotonic(), begun=True)
            monkeypatch.setattr(made, "_client", ReadyClient())
            nodes.kill("needed")
            while not made._deaths.again:
                made._look()

            def say(text: str) -> None:
                if "needed" in nodes.pids:
                    made._health.take([well], time.monotonic(), begun=True)

            monkeypatch.setattr(made, "_say", say)
            made._wait_for_the_dead()
            assert "needed" in nodes.pids
            assert not made._deaths.due
        finally:
            made.close()


class ReadyClient:
    """An action client whose server is there."""

    def server_is_ready(self) -> bool:
        return True

    def destroy(self) -> None:
        pass


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_takes_effect_between_two_steps(
    number: signal.Signals,
) -> None:
    def end(number: int, frame: object) -> None:
        signal.signal(number, signal.SIG_IGN)
        raise SystemExit(128 + number)

    before = signal.signal(number, end)
    try:
        held = HeldSignals()
        signal.raise_signal(number)
        signal.raise_signal(number)
        with pytest.raises(SystemExit) as ended:
            held.release()
        assert ended.value.code == 128 + number
        held.release()  # once is enough
        held.restore()
        assert signal.getsignal(number) == signal.SIG_IGN  # as the handler wanted
        signal.signal(number, end)
        HeldSignals().restore()
        assert signal.getsignal(number) == end
    finally:
        signal.signal(number, before)


def test_signals_at_the_end_only_hurry_it() -> None:
    class Ended(Exception):
        pass

    def end(number: int, frame: object) -> None:
        raise Ended

    before = signal.signal(signal.SIGINT, end)
    try:
        with EndingSignals() as signals:
            held = HeldSignals()
            signal.raise_signal(signal.SIGINT)
            signals.begin(held.waiting)
            held.restore()
            assert signals.count == 1
            signal.raise_signal(signal.SIGINT)
            assert signals.count == 2
            with pytest.raises(Ended):
                signals.pass_on()
        assert signal.getsignal(signal.SIGINT) == end
    finally:
        signal.signal(signal.SIGINT, before)


def test_the_smallest_clearance_is_kept_for_each_reach(
    conductor: Conductor, said: list[str]
) -> None:
    conductor._on_state(SimState(clearance=0.01))  # before the first cue
    for heard in ((1e9,), (0.3, 0.2, 0.25)):
        conductor._closest.append(float("inf"))
        for clearance in (1e9, *heard):
            conductor._on_state(SimState(clearance=clearance))
        conductor._next_say = 0.0
        conductor._say_status("reach 1/3", conductor._closest[-1])
        conductor._report_interrupted("Ctrl-C")
    assert [report.min_clearance_m for report in conductor.reports] == [None, 0.2]
    assert {report.outcome for report in conductor.reports} == {"interrupted"}
    assert "clear" not in said[0]
    assert "(least 20.0)" in said[1]
    # Nothing has been heard of this one yet.
    conductor._closest.append(float("inf"))
    conductor._next_say = 0.0
    conductor._say_status("reach 1/3", conductor._closest[-1])
    assert "clear" in said[2]
    assert "inf" not in said[2]


@pytest.mark.parametrize("person", ["person", "replayer"])
def test_a_simulated_person_takes_a_hand_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, person: str
) -> None:
    """A recorded one cannot; and nobody does while the robot has no goal."""
    told: list[str] = []
    nodes = Supervisor(tmp_path)
    monkeypatch.setattr(Supervisor, "pids", property(lambda self: {person: os.getpid()}))
    made = Conductor(SCENARIO, nodes, lambda text: None, told.append)
    try:
        reach = SCENARIO.reaches[0]
        made._withdrawing.begin(0, reach, made.now_ns() - 60 * NANO)
        made._on_status(PlannerStatus(reason=TOUCHED))
        made._on_state(SimState(human_part=f"{SCENARIO.persons[0].id}/hand"))

        def look_for(seconds: float) -> int:
            told.clear()
            made.rest(seconds)
            return sum("taken back" in text for text in told)

        assert look_for(1.3) == 0
        made._goal = object()
        assert look_for(1.5) == (person == "person")
        # The next reach waits for it.
        begin = time.monotonic()
        made._wait_for_the_person()
        left_s = 1.4 * reach.person_duration - 0.5
        assert (time.monotonic() - begin > left_s) == (person == "person")
    finally:
        made.close()
