"""Who moves the robot, as each node hears it from the others."""

from collections.abc import Callable
from typing import Any, cast

import pytest

from hri_planner.ros.authority import FORGOTTEN_NS, Authority
from hri_prediction.errors import PlanningError
from hri_prediction.ros.messages import PlannerStatus
from hri_prediction.ros.node import HriNode

MOVES = (PlannerStatus.MOVING, PlannerStatus.WAITING, PlannerStatus.STOPPING)


class Listener:
    """The part of a node that is needed."""

    def __init__(self) -> None:
        self.now = 10_000_000_000
        self.heard: dict[str, Callable[[Any], None]] = {}

    def now_ns(self) -> int:
        return self.now

    def listen(self, kind: type, topic: str, take: Callable[[Any], None], qos: Any) -> None:
        self.heard[topic] = take


def policys() -> tuple[Authority, Listener]:
    node = Listener()
    return Authority(cast(HriNode, node), "policy"), node


def test_each_hears_all_others_and_one_is_first() -> None:
    node = Listener()
    assert Authority(cast(HriNode, node), "ptomp").is_first
    assert list(node.heard) == ["policy/status"]
    authority, node = policys()
    assert not authority.is_first
    assert list(node.heard) == ["ptomp/status"]


@pytest.mark.parametrize("stage", MOVES)
def test_one_that_moves_keeps_others_from_it(stage: int) -> None:
    authority, node = policys()
    authority.check(node.now)
    node.heard["ptomp/status"](PlannerStatus(stage=stage))
    assert authority.holder(node.now) == authority.engaged(node.now) == "ptomp"
    with pytest.raises(PlanningError, match=r"ptomp moves the robot; cancel its motion"):
        authority.check(node.now)
    # One that has fallen silent moves nothing.
    authority.check(node.now + FORGOTTEN_NS)
    node.heard["ptomp/status"](PlannerStatus(stage=PlannerStatus.IDLE))
    authority.check(node.now)
    assert authority.engaged(node.now) == ""


def test_one_that_holds_a_goal_lets_others_move_but_keeps_its_heartbeat() -> None:
    authority, node = policys()
    node.heard["ptomp/status"](PlannerStatus(stage=PlannerStatus.HOLDING))
    authority.check(node.now)
    assert authority.holder(node.now) == ""
    assert authority.engaged(node.now) == "ptomp"
    assert authority.engaged(node.now + FORGOTTEN_NS) == ""


def test_after_the_clock_went_back_nothing_is_known() -> None:
    authority, node = policys()
    node.heard["ptomp/status"](PlannerStatus(stage=PlannerStatus.MOVING))
    authority.check(node.now - 2 * FORGOTTEN_NS)
