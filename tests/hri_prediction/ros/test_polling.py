"""Messages that wait until a node takes them."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from std_msgs.msg import Float64

from hri_prediction.ros.polling import PollingNode
from hri_prediction.ros.qos import reliable
from hri_sim.testing.domain import own_domain


@pytest.fixture
def context() -> Iterator[Context]:
    made = Context()
    rclpy.init(context=made, domain_id=own_domain())
    yield made
    rclpy.try_shutdown(context=made)


@pytest.fixture
def node(context: Context) -> Iterator[PollingNode]:
    made = PollingNode("polling", context=context, start_parameter_services=False)
    yield made
    made.destroy_node()


@pytest.fixture
def executor(context: Context, node: PollingNode) -> Iterator[Executor]:
    made = EventsExecutor(context=context)
    made.add_node(node)
    yield made
    made.shutdown()


def test_all_is_let_in_for_a_time_that_has_an_end(node: PollingNode, executor: Executor) -> None:
    """Also where callbacks come faster than they are done."""
    ticks: list[float] = []

    def tick() -> None:
        ticks.append(time.monotonic())
        time.sleep(0.015)

    node.create_timer(0.01, tick)
    begin = time.monotonic()
    node.let_in(executor, 0.3)
    assert time.monotonic() - begin >= 0.3
    assert len(ticks) > 2
    count = len(ticks)
    node.let_in(executor, 0.1)
    assert len(ticks) > count


def test_what_a_callback_raises_ends_it(node: PollingNode, executor: Executor) -> None:
    def fail() -> None:
        raise ValueError("no")

    node.create_timer(0.01, fail)
    with pytest.raises(ValueError, match="no"):
        node.let_in(executor, 600.0)


def test_polled_messages_wait_until_they_are_taken(node: PollingNode, executor: Executor) -> None:
    polled: list[float] = []
    called: list[float] = []
    node.poll_topic(Float64, "said", lambda message: polled.append(message.data), reliable(10))
    node.create_subscription(
        Float64, "said", lambda message: called.append(message.data), reliable(10)
    )
    said = node.create_publisher(Float64, "said", reliable(10))
    end = time.monotonic() + 30.0
    while said.get_subscription_count() < 2 and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)
    for value in (1.0, 2.0, 3.0):
        said.publish(Float64(data=value))
    while len(called) < 3 and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)
    assert called == [1.0, 2.0, 3.0]
    assert not polled
    while len(polled) < 3 and time.monotonic() < end:
        node.let_in(executor, 0.02)
    assert polled == [1.0, 2.0, 3.0]
