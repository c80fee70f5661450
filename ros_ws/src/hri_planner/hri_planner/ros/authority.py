"""One motion authority: of several nodes that can move the robot, one does."""

from __future__ import annotations

from hri_prediction.errors import PlanningError
from hri_prediction.ros.messages import PlannerStatus, PolicyStatus
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable

STATUSES = {"ptomp": PlannerStatus, "policy": PolicyStatus}
"""Nodes that move the robot, with the type of their ``<name>/status``; stages are the same in all.

Where two have begun before they heard of each other, the first of these goes on.
"""

FORGOTTEN_NS = 500_000_000
"""A node that has said nothing for so long moves nothing any more [ns]."""

_MOVES = (PlannerStatus.MOVING, PlannerStatus.WAITING, PlannerStatus.STOPPING)


class Authority:
    """Listens to what the other nodes do with the robot.

    Args:
        node: The node that wants to know.
        name: Its own name among :data:`STATUSES`.

    Attributes:
        is_first: Whether it is the one that goes on where two have begun at once.
    """

    def __init__(self, node: HriNode, name: str) -> None:
        self._node = node
        self.is_first = name == next(iter(STATUSES))
        self._moving: dict[str, int] = {}
        self._holding: dict[str, int] = {}
        for other, kind in STATUSES.items():
            if other != name:
                self._listen(other, kind)

    def _listen(self, other: str, kind: type) -> None:
        def take(message: PlannerStatus | PolicyStatus) -> None:
            # By the time of receipt: what is asked is whether it still speaks.
            self._moving.pop(other, None)
            self._holding.pop(other, None)
            if message.stage in _MOVES:
                self._moving[other] = self._node.now_ns()
            elif message.stage == PlannerStatus.HOLDING:
                self._holding[other] = self._node.now_ns()

        self._node.listen(kind, f"{other}/status", take, reliable(10))

    def holder(self, now_ns: int) -> str:
        """The other node that moves the robot now [ns]; empty: none does."""
        return _newest(self._moving, now_ns)

    def engaged(self, now_ns: int) -> str:
        """The other node that moves the robot, or holds it at a goal, now [ns]; empty: none does."""
        return self.holder(now_ns) or _newest(self._holding, now_ns)

    def check(self, now_ns: int) -> None:
        """Check that no other node moves the robot.

        Raises:
            PlanningError: naming the one that does.
        """
        if other := self.holder(now_ns):
            raise PlanningError(
                f"{other} moves the robot", hint="cancel its motion, or wait until that is over"
            )


def _newest(said: dict[str, int], now_ns: int) -> str:
    """A node that has said so a moment ago."""
    for other, said_ns in said.items():
        if abs(now_ns - said_ns) < FORGOTTEN_NS:
            return other
    return ""
