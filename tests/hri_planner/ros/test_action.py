"""Goals that run on ticks leave the executor idle in between."""

import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.action import ActionClient, CancelResponse, GoalResponse
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from hri_planner.ros.action import TickedActionServer
from hri_prediction.ros.messages import ReachTarget
from hri_sim.testing.domain import own_domain


@pytest.fixture
def node() -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context, domain_id=own_domain())
    node = Node("action_test", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def test_a_running_goal_costs_nothing_and_ends_when_told(node: Node) -> None:
    handles = []
    server = TickedActionServer(
        node,
        ReachTarget,
        "reach",
        goal_callback=lambda _: GoalResponse.ACCEPT,
        handle_accepted_callback=lambda handle: (handle.execute(), handles.append(handle)),
        cancel_callback=lambda _: CancelResponse.ACCEPT,
    )
    client = ActionClient(node, ReachTarget, "reach")
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def spin_until(done, timeout_s=10.0):
        end = time.monotonic() + timeout_s
        while not done():
            assert time.monotonic() < end
            executor.spin_once(timeout_sec=0.1)

    spin_until(client.server_is_ready)
    sent = client.send_goal_async(ReachTarget.Goal())
    spin_until(lambda: sent.done() and handles)
    result = sent.result().get_result_async()
    end, spins = time.monotonic() + 1.0, 0
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.1)
        spins += 1
    # With a coroutine that waits for the end of the goal this is tens of thousands.
    assert spins < 100
    assert not result.done()

    handles[0].succeed()
    server.send_result(handles[0], ReachTarget.Result(outcome=3, reason="told so"))
    spin_until(result.done)
    assert result.result().result.reason == "told so"
    executor.shutdown()
    client.destroy()
    server.destroy()
