"""A policy counts as loaded only when it is the one that the policy node has taken."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.task import Future

from hri_planner.dmp.model_file import load_dmp
from hri_planner.nodes import adaptation_requests
from hri_planner.nodes.adaptation_requests import ANSWER_S, PolicyRequests
from hri_planner.pibb.experiment import find_experiment, load_experiment
from hri_planner.robot.model import load_robot
from hri_prediction.errors import GraphError
from hri_prediction.ros.time import seconds_to_ns

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
