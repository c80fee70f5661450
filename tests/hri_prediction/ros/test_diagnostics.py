"""What a node says on /diagnostics of its topics, ticks and faults; its time is the test's."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header

from hri_prediction.ros.diagnostics import ERROR, OK, WARN, Fault, summary
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_time
from hri_sim.testing.domain import own_domain

DOMAIN = own_domain("diagnostics")
BEGIN = 1000 * NANO
MS = 1_000_000


class Told(HriNode):
    """Listens to topics of four kinds, and says something on each tick."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("told", period_s=0.01, **kwargs)
        self.level, self.text = OK, "well"
        self.listen(JointState, "stream", lambda _: None, SENSOR)
        self.listen(Float64, "plain", lambda _: None, reliable(50))
        self.listen(JointState, "latched", lambda _: None, LATCHED)
        self.listen(JointState, "command", lambda _: None, reliable(5), command=True)
        self.out = self.announce(Float64, "out", reliable(1))

    def on_tick(self, now_ns: int) -> None:
        self.out.publish(Float64())

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        return self.level, self.text, {"received /counted/elsewhere": self.out.sent * 2}


class Rig:
    """The node, a node that speaks to it, and what was said on /diagnostics."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = Told(context=self.context, lockstep_ns=BEGIN)
        self.outside = Node("outside", context=self.context)
        self.heard: list[DiagnosticStatus] = []
        self.outside.create_subscription(
            DiagnosticArray, "/diagnostics", lambda m: self.heard.extend(m.status), 50
        )
        self.executor = SingleThreadedExecutor(context=self.context)
        for node in (self.node, self.outside):
            self.executor.add_node(node)
        self.publishers: dict[str, Any] = {}
        for topic, kind, qos in (
            ("/stream", JointState, SENSOR),
            ("/plain", Float64, reliable(50)),
            ("/latched", JointState, LATCHED),
            ("/command", JointState, reliable(5)),
        ):
            self.publishers[topic] = self.outside.create_publisher(kind, topic, qos)
        every = self.publishers.values()
        self.until(lambda: all(p.get_subscription_count() for p in every))
        self.until(lambda: self.node.count_subscribers("/diagnostics") == 1)

    def until(self, done: Callable[[], bool]) -> None:
        end = time.monotonic() + 10.0
        while not done():
            assert time.monotonic() < end, "timed out"
            self.executor.spin_once(timeout_sec=0.02)

    def send(self, topic: str, stamp_ns: int | None = None) -> None:
        """Send a message; it is received at the node's present time."""
        count = self.node.received[topic]
        stamp = Header() if stamp_ns is None else Header(stamp=to_time(stamp_ns))
        self.publishers[topic].publish(Float64() if topic == "/plain" else JointState(header=stamp))
        self.until(lambda: self.node.received[topic] > count)

    def tell(self, now_ns: int) -> tuple[bytes, str, dict[str, str]]:
        """Level, words and figures at a time, a second or more after the one before."""
        count = len(self.heard)
        self.node.tick(now_ns)
        self.until(lambda: len(self.heard) > count)
        status = self.heard[-1]
        return status.level, status.message, {v.key: v.value for v in status.values}


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    yield rig
    rig.executor.shutdown()
    rig.node.destroy_node()
    rig.outside.destroy_node()
    rclpy.try_shutdown(context=rig.context)


def test_rates_ages_and_latencies(rig: Rig) -> None:
    _, _, first = rig.tell(BEGIN)
    assert not [key for key in first if "_hz" in key or key.startswith(("age_s", "latency"))]
    for delay_ms in (1, 2, 3, 40):
        rig.send("/stream", BEGIN - delay_ms * MS)
    for topic in ("/plain", "/plain", "/latched", "/command"):
        rig.send(topic, BEGIN - 100 * MS)
    level, text, figures = rig.tell(BEGIN + NANO)
    assert (level, text) == (OK, "well")
    assert {key: value for key, value in figures.items() if "_hz" in key} == {
        "received_hz /stream": "4.0",
        "received_hz /plain": "2.0",
        "received_hz /latched": "1.0",
        "received_hz /command": "1.0",
        "received_hz /counted/elsewhere": "2.0",
        "sent_hz /out": "1.0",
        "tick_hz": "1.0",
    }
    assert {key: value for key, value in figures.items() if key.startswith("latency")} == {
        "latency_ms_p50 /stream": "3.000",
        "latency_ms_p99 /stream": "40.000",
    }
    assert figures["age_s /stream"] == "1.040"
    assert figures["age_s /plain"] == "1.000"  # since the receipt: it has no stamp
    assert figures["age_s /latched"] == "1.000"  # its stamp may be of long ago
    assert figures["age_s /command"] == "1.000"  # its stamp says when it is to take effect
    assert (first["up_s"], figures["up_s"]) == ("0.000", "1.000")
    assert figures["period_ms"] == "10"
    assert (figures["received /stream"], figures["sent /out"]) == ("4", "2")


def test_a_stream_that_runs_dry_is_a_warning(rig: Rig) -> None:
    rig.tell(BEGIN)
    for topic in ("/stream", "/plain"):
        rig.send(topic, BEGIN)
    assert rig.tell(BEGIN + NANO)[0] == OK
    level, text, figures = rig.tell(BEGIN + 3 * NANO)
    assert (level, text) == (WARN, "nothing on /stream for 3.0 s")
    assert figures["quiet_s /stream"] == "3.0"
    assert "quiet_s /plain" not in figures  # others may be silent for as long as they like
    rig.node.level, rig.node.text = ERROR, "the arm is lost"
    assert rig.tell(BEGIN + 4 * NANO)[:2] == (ERROR, "the arm is lost")
    rig.node.level, rig.node.text = OK, "well"
    rig.send("/stream", BEGIN + 4 * NANO)
    assert rig.tell(BEGIN + 5 * NANO)[:2] == (OK, "well")
    rig.node.ignore("stream")
    level, _, figures = rig.tell(BEGIN + 9 * NANO)
    assert level == OK
    assert not [key for key in figures if "/stream" in key]


def test_faults_are_told_by_their_keys(rig: Rig) -> None:
    rig.tell(BEGIN)
    rig.node.fault("joints", "joint a is missing")
    level, text, figures = rig.tell(BEGIN + NANO)
    assert (level, text) == (WARN, "joint a is missing")
    assert figures["fault joints"] == "joint a is missing"
    rig.node.fault("disk", "the disk is full", ERROR)
    level, text, figures = rig.tell(BEGIN + 2 * NANO)
    assert (level, text) == (ERROR, "joint a is missing; the disk is full")
    assert rig.node.faults == ("joint a is missing", "the disk is full")
    level, text, figures = rig.tell(BEGIN + 20 * NANO)
    assert (level, text) == (OK, "well")
    assert not [key for key in figures if key.startswith("fault")]


def test_the_level_of_this_moment_is_without_faults_that_are_over(rig: Rig) -> None:
    rig.tell(BEGIN)
    rig.node.fault("joints", "joint a is missing")
    told = [rig.tell(BEGIN + after_ms * MS) for after_ms in (900, 2000, 5100)]
    assert [(level, figures["level_now"]) for level, _, figures in told] == [
        (WARN, "1"),
        (WARN, "0"),
        (OK, "0"),
    ]
    rig.node.level = ERROR
    assert rig.tell(BEGIN + 7000 * MS)[2]["level_now"] == "2"


def test_a_new_fault_is_told_at_once_but_not_every_tick(rig: Rig) -> None:
    rig.tell(BEGIN)
    rig.node.fault("joints", "joint a is missing")
    rig.node.tick(BEGIN + 50 * MS)  # sooner than a tenth of a second after what was told last
    assert rig.tell(BEGIN + 100 * MS)[1] == "joint a is missing"
    count = len(rig.heard)
    rig.node.fault("joints", "joint a is still missing")  # known: with the rest, once a second
    for later_ms in range(110, 1100, 110):
        rig.node.tick(BEGIN + later_ms * MS)
    assert rig.tell(BEGIN + 1100 * MS)[1] == "joint a is still missing"
    assert len(rig.heard) == count + 1


def test_nothing_is_said_twice() -> None:
    def fault(text: str, level: bytes = WARN) -> Fault:
        return Fault(0, text, level)

    assert summary(OK, "idle", (), {}) == (OK, "idle")
    assert summary(WARN, "no arm", (fault("no arm"),), {"/arm": 2.0}) == (WARN, "no arm")
    assert summary(OK, "idle", (fault("a"), fault("b", ERROR)), {}) == (ERROR, "a; b")
    longer = (fault("3 trials in a row broken off: no arm"),)
    assert summary(ERROR, "no arm", longer, {}) == (ERROR, longer[0].text)
    assert summary(ERROR, "a touches b", (fault("was not run for 1 s"),), {}) == (
        ERROR,
        "a touches b; was not run for 1 s",
    )


@pytest.mark.parametrize("simulated", [False, True])
def test_messages_between_two_ticks_are_timed_by_the_clock_of_the_node(simulated: bool) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = Told(context=context, parameter_overrides=[Parameter("use_sim_time", value=simulated)])
    try:
        node.tick()
        # In simulated time that nobody gives, it is zero: what passes since the tick is added.
        assert abs(node._receipt_ns(time.time_ns()) - node.now_ns()) < 0.5 * NANO
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
