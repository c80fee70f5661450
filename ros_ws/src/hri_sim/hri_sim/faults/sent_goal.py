"""A goal that was sent, and how it ended."""

from __future__ import annotations

from typing import Any

from rclpy.action import ActionClient
from rclpy.task import Future

from hri_sim.launch.reports import OUTCOMES

REFUSED = "refused"
BY_ITSELF = ("reached", "blocked")
"""How motions end that nothing is done to: a person may stand where the robot is to go."""


class SentGoal:
    """A goal on its way; what becomes of it is heard while its client is spun.

    Args:
        client: Of the action ``reach_target``.
        goal: Its goal.

    Attributes:
        outcome: How it ended, one of :data:`~hri_sim.launch.reports.OUTCOMES` or :data:`REFUSED`; empty
            while it goes on.
    """

    def __init__(self, client: ActionClient, goal: Any) -> None:
        self.outcome = ""
        client.send_goal_async(goal).add_done_callback(self._on_answer)

    @property
    def ended_by_itself(self) -> bool:
        """Whether it has ended as one that nothing was done to."""
        return self.outcome in BY_ITSELF

    def _on_answer(self, answer: Future) -> None:
        handle = answer.result()
        if handle is None or not handle.accepted:
            self.outcome = REFUSED
        else:
            handle.get_result_async().add_done_callback(self._on_end)

    def _on_end(self, end: Future) -> None:
        self.outcome = OUTCOMES.get(end.result().result.outcome, "failed")
