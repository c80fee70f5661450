"""What all nodes share: the inbox between two ticks, and notice of not having been run."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

from hri_prediction.ros.messages import Reset
from hri_prediction.ros.node import COUNTED_DROPS, STANDSTILL_S, HriNode
from hri_prediction.ros.qos import reliable
from hri_sim.testing.domain import own_domain

DOMAIN = own_domain("hri_node")


class Listener(HriNode):
    """Keeps what it is handed, and counts its ticks."""

    def __init__(self, period_s: float = 0.01, **kwargs: Any) -> None:
        super().__init__("listener", period_s=period_s, **kwargs)
        self.numbers: list[float] = []
        self.ticks = 0
        self.listen(
            Float64, "number", lambda message: self.numbers.append(message.data), reliable(5)
        )

    def on_tick(self, now_ns: int) -> None:
        self.ticks += 1


class Rig:
    """A context with an executor, and a plain node beside the one that is looked at."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = Node("outside", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.made: list[Listener] = []

    def listener(self, simulated: bool = False, **kwargs: Any) -> Listener:
        overrides = [Parameter("use_sim_time", value=simulated)]
        self.made.append(Listener(context=self.context, parameter_overrides=overrides, **kwargs))
        self.executor.add_node(self.made[-1])
        return self.made[-1]

    def until(self, done: Callable[[], bool]) -> None:
        end = time.monotonic() + 10.0
        while not done():
            assert time.monotonic() < end, "timed out"
            self.executor.spin_once(timeout_sec=0.02)

    def hear(self, node: Listener, count: int) -> None:
        """Until a node whose clock stands has taken so many numbers."""

        def heard() -> bool:
            node.take()
            return node.received["/number"] == count

        self.until(heard)


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    yield rig
    rig.executor.shutdown()
    for node in (*rig.made, rig.node):
        node.destroy_node()
    rclpy.try_shutdown(context=rig.context)


def test_while_the_clock_stands_the_newest_messages_wait(rig: Rig) -> None:
    node = rig.listener(simulated=True)  # and nobody is there who gives the time
    status: list[dict[str, str]] = []
    rig.node.create_subscription(
        DiagnosticArray,
        "/diagnostics",
        lambda message: status.append({v.key: v.value for v in message.status[0].values}),
        10,
    )
    numbers = rig.node.create_publisher(Float64, "number", reliable(50))
    rig.until(lambda: numbers.get_subscription_count() == 1)
    for number in range(40):
        numbers.publish(Float64(data=float(number)))
        rig.hear(node, number + 1)
    assert node.ticks == 0
    rig.until(lambda: node.count_subscribers("/diagnostics") == 1)
    node.tick()
    assert node.numbers == [35.0, 36.0, 37.0, 38.0, 39.0]
    rig.until(lambda: len(status) > 0)
    assert status[0]["received /number"] == "40"
    assert status[0]["dropped /number"] == "35"
    numbers.publish(Float64(data=1.5))
    rig.hear(node, 41)
    node.tick()
    assert node.numbers[5:] == [1.5]


def test_what_is_ignored_is_not_handed_over(rig: Rig) -> None:
    node = rig.listener(simulated=True)
    numbers = rig.node.create_publisher(Float64, "number", reliable(10))
    rig.until(lambda: numbers.get_subscription_count() == 1)
    numbers.publish(Float64(data=1.0))
    rig.hear(node, 1)
    node.ignore("number")
    assert "/number" not in node.received
    node.tick()
    assert node.numbers == []
    rig.until(lambda: numbers.get_subscription_count() == 0)
    node.listen(Float64, "number", lambda message: node.numbers.append(message.data), reliable(5))
    rig.until(lambda: numbers.get_subscription_count() == 1)
    numbers.publish(Float64(data=2.0))
    rig.hear(node, 1)
    node.tick()
    assert node.numbers == [2.0]


def test_messages_wait_for_the_tick_and_wake_nobody(rig: Rig) -> None:
    node = rig.listener(simulated=True)
    numbers = rig.node.create_publisher(Float64, "number", reliable(10))
    rig.until(lambda: numbers.get_subscription_count() == 1)
    # What the executor looks after: none of those that are listened to.
    assert "/number" not in {one.topic_name for one in node.subscriptions}
    for number in range(3):
        numbers.publish(Float64(data=float(number)))
    end = time.monotonic() + 0.3
    while time.monotonic() < end:
        rig.executor.spin_once(timeout_sec=0.02)
    assert node.received["/number"] == 0
    node.tick()
    assert node.numbers == [0.0, 1.0, 2.0]
    assert node.received["/number"] == 3


def test_of_many_messages_between_two_ticks_the_newest_are_kept_and_some_of_the_rest_counted(
    rig: Rig,
) -> None:
    node = rig.listener(simulated=True)
    numbers = rig.node.create_publisher(Float64, "number", reliable(200))
    rig.until(lambda: numbers.get_subscription_count() == 1)
    for number in range(150):
        numbers.publish(Float64(data=float(number)))
    time.sleep(0.3)
    node.tick()
    assert node.numbers == [145.0, 146.0, 147.0, 148.0, 149.0]
    assert node.received["/number"] == 5 + COUNTED_DROPS


def held_up(node: Listener) -> bool:
    return any("was not run for" in fault for fault in node.faults)


@pytest.mark.parametrize("steady", [False, True])
def test_a_node_that_is_not_run_says_so(rig: Rig, steady: bool) -> None:
    # A timer on a clock of its own is watched in simulated time, too.
    node = rig.listener(simulated=steady)
    if steady:
        node.set_period(0.01, Clock(clock_type=ClockType.STEADY_TIME))
    rig.until(lambda: node.ticks > 3)
    assert not held_up(node)
    time.sleep(1.4 * STANDSTILL_S)
    ticks = node.ticks
    rig.until(lambda: node.ticks > ticks)
    assert held_up(node)


def test_a_clock_that_stands_is_no_standstill(rig: Rig) -> None:
    node = rig.listener(simulated=True)
    node.tick()
    time.sleep(1.1 * STANDSTILL_S)
    node.tick()
    assert not held_up(node)


def test_the_work_of_a_service_is_no_standstill(rig: Rig) -> None:
    node = rig.listener()

    def slow(request: Reset.Request, response: Reset.Response) -> Reset.Response:
        time.sleep(1.4 * STANDSTILL_S)
        response.success = True
        return response

    node.serve(Reset, "~/reset", slow)
    client = rig.node.create_client(Reset, "/listener/reset")
    rig.until(lambda: client.service_is_ready() and node.ticks > 3)
    answer = client.call_async(Reset.Request())
    rig.until(answer.done)
    ticks = node.ticks
    rig.until(lambda: node.ticks > ticks + 3)
    assert answer.result().success
    assert not held_up(node)


def test_how_long_ago_the_time_was_read(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when the node is held up right after it; in lock-step time stands still."""
    found: list[float] = []
    for node in (rig.listener(period_s=10.0), rig.listener(lockstep_ns=1)):

        def late(node: Listener = node, now_ns: Callable[[], int] = node.now_ns) -> int:
            read = now_ns()
            time.sleep(0.02)
            return read

        monkeypatch.setattr(node, "now_ns", late)
        monkeypatch.setattr(node, "on_tick", lambda now_ns, node=node: found.append(node.held_s()))
        node.tick()
    assert 0.02 <= found[0] < 5.0
    assert found[1] == 0.0
