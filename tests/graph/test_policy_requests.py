"""A policy counts as loaded only when it is the one that the policy node has taken."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from rclpy.task import Future

from hri_planner.dmp.model_file import load_dmp
from hri_planner.nodes import adaptation_requests
from hri_planner.nodes.adaptation_requests import ANSWER_S, PolicyRequests
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.robot.model import load_robot
from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import PolicyStatus, ReachTarget
from hri_prediction.ros.time import seconds_to_ns, to_time

FIRST = load_experiment(find_experiment("transfer")).initial_policy(load_robot())
SECOND = replace(FIRST, weights={name: own + 0.01 for name, own in FIRST.weights.items()})


class Asked:
    """Stands for a service: keeps what is asked, answers when it is told to."""

    def __init__(self) -> None:
        self.futures: list[Any] = []

    def call_async(self, request: Any) -> Any:
        self.futures.append(Future())
        return self.futures[-1]

    def answer(self, success: bool = True) -> None:
        self.futures[-1].set_result(SimpleNamespace(success=success, message="no"))


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[PolicyRequests, Asked, Any]:
    monkeypatch.setattr(adaptation_requests, "ActionClient", lambda *_: SimpleNamespace())
    service, clock = Asked(), SimpleNamespace(now=0)
    node: Any = SimpleNamespace(
        create_client=lambda *_: service, listen=lambda *_: None, now_ns=lambda: clock.now
    )
    return PolicyRequests(node, tmp_path / "trial.npz"), service, clock


def test_an_answer_is_that_of_the_policy_that_was_asked_for(asked, tmp_path: Path) -> None:
    requests, service, _ = asked
    assert not requests.has(FIRST, 0)
    assert not requests.has(SECOND, 0), "an update came meanwhile"
    service.answer()
    assert not requests.has(SECOND, 0), "the first was taken, not this one"
    assert not requests.has(SECOND, 0)
    assert len(service.futures) == 2
    held = load_dmp(tmp_path / "trial.npz")
    assert held.weights["left"] == pytest.approx(SECOND.weights["left"])
    service.answer()
    assert requests.has(SECOND, 0)
    assert requests.has(SECOND, 1)
    assert len(service.futures) == 2, "it is not asked for again"


def test_what_is_not_taken_or_answered_breaks_the_trial_off(asked) -> None:
    requests, service, clock = asked
    requests.has(FIRST, 0)
    service.answer(success=False)
    with pytest.raises(GraphError, match="did not take the policy: no"):
        requests.has(FIRST, 0)
    requests.forget()
    requests.has(FIRST, 0)
    clock.now = seconds_to_ns(ANSWER_S + 1.0)
    with pytest.raises(GraphError, match="did not answer within"):
        requests.has(FIRST, 0)


class Motion:
    """Stands for the action and a goal that it has accepted."""

    accepted = True

    def __init__(self) -> None:
        self.sent, self.result, self.cancels = Future(), Future(), []

    def send_goal_async(self, goal: Any) -> Any:
        return self.sent

    def server_is_ready(self) -> bool:
        return True

    def get_result_async(self) -> Any:
        return self.result

    def cancel_goal_async(self) -> Any:
        self.cancels.append(Future())
        return self.cancels[-1]

    def over(self, status: int, outcome: int) -> None:
        what = SimpleNamespace(outcome=outcome, reason="why")
        self.result.set_result(SimpleNamespace(status=status, result=what))


@pytest.fixture
def motion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[PolicyRequests, Motion, Callable[..., None]]:
    found, said = Motion(), []
    monkeypatch.setattr(adaptation_requests, "ActionClient", lambda *_: found)
    node: Any = SimpleNamespace(
        create_client=lambda *_: Asked(),
        listen=lambda _, __, callback, *___: said.append(callback),
        now_ns=lambda: 7,
    )
    requests = PolicyRequests(node, tmp_path / "trial.npz")
    requests.end()  # nothing is under way
    requests.send(np.zeros(3), 1.0)
    requests.end()  # not accepted yet
    found.sent.set_result(found)
    assert not requests.arrived()
    return requests, found, said[0]


@pytest.mark.parametrize(
    ("status", "outcome"),
    [
        (GoalStatus.STATUS_CANCELED, ReachTarget.Result.CANCELLED),
        (GoalStatus.STATUS_ABORTED, ReachTarget.Result.BLOCKED),  # given up a moment before
        (GoalStatus.STATUS_SUCCEEDED, ReachTarget.Result.REACHED),
    ],
)
def test_a_motion_that_was_asked_to_end_is_over(motion, status: int, outcome: int) -> None:
    requests, action, _ = motion
    requests.end()
    requests.end()
    assert len(action.cancels) == 1
    assert not requests.settled
    action.cancels[0].set_result(SimpleNamespace(goals_canceling=["it"]))
    assert requests.settled
    requests.end()
    assert len(action.cancels) == 1
    assert not requests.arrived()
    action.over(status, outcome)
    assert requests.arrived()


def test_an_end_that_was_refused_is_asked_for_again(motion) -> None:
    requests, action, _ = motion
    requests.end()
    action.cancels[0].set_result(SimpleNamespace(goals_canceling=[]))
    requests.end()
    assert len(action.cancels) == 2


@pytest.mark.parametrize(
    ("asked_for", "outcome"),
    [(False, ReachTarget.Result.BLOCKED), (True, ReachTarget.Result.LOST_INPUT)],
)
def test_other_ends_break_the_trial_off(motion, asked_for: bool, outcome: int) -> None:
    requests, action, _ = motion
    if asked_for:
        requests.end()
    action.over(GoalStatus.STATUS_ABORTED, outcome)
    with pytest.raises(GraphError, match="why"):
        requests.arrived()


def test_when_the_filter_kept_the_robot_is_of_this_motion(motion) -> None:
    requests, _, hear = motion
    assert requests.kept_ns is None
    hear(PolicyStatus(stage=PolicyStatus.MOVING, handover=to_time(3), filtered=False))
    assert (requests.begins_ns, requests.kept_ns) == (3, None)
    hear(PolicyStatus(stage=PolicyStatus.WAITING, handover=to_time(4), filtered=True))
    assert requests.kept_ns is None
    hear(PolicyStatus(stage=PolicyStatus.MOVING, handover=to_time(4), filtered=True))
    assert requests.kept_ns == 7
    requests.send(np.zeros(3), 1.0)
    assert requests.kept_ns is None


def test_a_motion_by_another_policy_breaks_the_trial_off(motion, tmp_path: Path) -> None:
    requests, action, hear = motion
    hear(PolicyStatus(stage=PolicyStatus.MOVING, policy=str(tmp_path / "trial.npz")))
    hear(PolicyStatus(stage=PolicyStatus.MOVING, policy="rnn_gru_9x9_d1"))
    action.over(GoalStatus.STATUS_SUCCEEDED, ReachTarget.Result.REACHED)
    with pytest.raises(GraphError, match="moved by rnn_gru_9x9_d1"):
        requests.arrived()


def test_what_is_forgotten_is_ended(motion) -> None:
    requests, action, _ = motion
    requests.forget()
    assert len(action.cancels) == 1
    requests.forget()
    assert len(action.cancels) == 1


@pytest.mark.parametrize("accepted", [True, False])
def test_a_goal_that_is_taken_later_than_anybody_waits_for_it_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, accepted: bool
) -> None:
    action = Motion()
    monkeypatch.setattr(adaptation_requests, "ActionClient", lambda *_: action)
    node: Any = SimpleNamespace(
        create_client=lambda *_: Asked(), listen=lambda *_: None, now_ns=lambda: 7
    )
    requests = PolicyRequests(node, tmp_path / "trial.npz")
    requests.send(np.zeros(3), 1.0)
    requests.forget()
    action.accepted = accepted
    action.sent.set_result(action)
    assert len(action.cancels) == accepted
