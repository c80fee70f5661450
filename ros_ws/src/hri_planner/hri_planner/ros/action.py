"""An action server for nodes that compute on ticks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action import ActionServer


class TickedActionServer(ActionServer):
    """Its goals run from ``handle.execute()`` until :meth:`send_result`, with no coroutine in between.

    A coroutine that awaits the end of a goal is resumed by rclpy's executors as often as they can: the
    node then spins at full load for as long as a goal runs, and its other threads starve.
    """

    def __init__(self, node: Any, action_type: Any, name: str, **callbacks: Any) -> None:
        super().__init__(node, action_type, name, self._never, **callbacks)

    @staticmethod
    def _never(goal_handle: Any) -> Any:
        raise RuntimeError("goals of this server run on ticks")

    def notify_execute(
        self, goal_handle: Any, execute_callback: Callable[[Any], Any] | None
    ) -> None:
        """The goal is executing from now on; ticks do the work."""

    def send_result(self, goal_handle: Any, result: Any) -> None:
        """Answer whoever waits for the result; the goal has been set to its final state before."""
        super().notify_execute(goal_handle, lambda _: result)
