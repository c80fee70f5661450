"""What becomes of a goal that was sent."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.task import Future

from hri_prediction.ros.messages import ReachTarget
from hri_sim.faults.sent_goal import REFUSED, SentGoal


class Client:
    """Sends nothing; the test answers."""

    def __init__(self) -> None:
        self.answer, self.end = Future(), Future()

    def send_goal_async(self, goal: Any) -> Future:
        return self.answer


def handle(client: Client, *, accepted: bool) -> SimpleNamespace:
    return SimpleNamespace(accepted=accepted, get_result_async=lambda: client.end)


def run(future: Future) -> None:
    """No executor: callbacks of a future are called at once."""
    assert future.done()


@pytest.mark.parametrize(
    ("outcome", "word", "by_itself"),
    [
        (ReachTarget.Result.REACHED, "reached", True),
        (ReachTarget.Result.BLOCKED, "blocked", True),
        (ReachTarget.Result.LOST_INPUT, "lost_input", False),
        (ReachTarget.Result.CANCELLED, "cancelled", False),
        (99, "failed", False),
    ],
)
def test_how_it_ended(outcome: int, word: str, by_itself: bool) -> None:
    client = Client()
    goal = SentGoal(client, None)  # type: ignore[arg-type]
    assert not goal.outcome
    client.answer.set_result(handle(client, accepted=True))
    run(client.answer)
    assert not goal.outcome
    assert not goal.ended_by_itself
    client.end.set_result(SimpleNamespace(result=SimpleNamespace(outcome=outcome)))
    run(client.end)
    assert goal.outcome == word
    assert goal.ended_by_itself is by_itself


def test_one_that_is_refused_has_ended() -> None:
    client = Client()
    goal = SentGoal(client, None)  # type: ignore[arg-type]
    client.answer.set_result(handle(client, accepted=False))
    assert goal.outcome == REFUSED
    assert not goal.ended_by_itself
