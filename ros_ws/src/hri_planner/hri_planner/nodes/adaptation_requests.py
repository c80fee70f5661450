"""What the adaptation node asks of the policy node: to take a policy, and to go to a place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from action_msgs.msg import GoalStatus
from numpy.typing import NDArray
from rclpy.action import ActionClient

from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_prediction.errors import GraphError
from hri_prediction.files.whole import write_whole
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import LoadModel, PolicyStatus, ReachTarget
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import NANO, to_ns

ANSWER_S = 5.0
"""So long may the policy node take to answer a request, or say nothing of the motion under way [s]."""
_ENDED = (ReachTarget.Result.CANCELLED, ReachTarget.Result.BLOCKED)
_MOVES_NS = 500_000_000
"""A policy node that has said so long ago that it moves the robot may have been killed since [ns]."""
_MOVES = (PolicyStatus.MOVING, PolicyStatus.WAITING, PolicyStatus.STOPPING)


class PolicyRequests:
    """One request at a time; answers are looked for on ticks.

    Args:
        node: That asks.
        file: Where policies are handed over.

    Attributes:
        begins_ns: When the first plan of the present motion takes effect [ns]; none so far.
        kept_ns: When a plan of the present motion was last kept at a distance from people, table or boxes
            [ns]; none so far.
    """

    def __init__(self, node: HriNode, file: Path) -> None:
        self._node, self._file = node, file
        self._load = node.create_client(LoadModel, "policy/load_model")
        self._reach = ActionClient(node, ReachTarget, "policy/reach_target")
        node.listen(PolicyStatus, "policy/status", self._on_status, reliable(10))
        self._stage = PolicyStatus.IDLE
        self._loaded: DmpPolicy | None = None
        self._loading: DmpPolicy | None = None
        self._asked: Any = None
        self._asked_ns = 0
        self._handle: Any = None
        self._result: Any = None
        self._ending: Any = None
        self._moves_by = ""
        self._under_way = False
        self._heard_ns = 0
        self.begins_ns: int | None = None
        self.kept_ns: int | None = None

    def close(self) -> None:
        """Let the action go."""
        self._reach.destroy()

    def _on_status(self, message: PolicyStatus) -> None:
        self._stage = message.stage
        if message.stage in _MOVES:
            self._heard_ns = self._node.now_ns()
        begins_ns = to_ns(message.handover)
        if self._under_way and message.stage == PolicyStatus.MOVING and message.policy:
            self._moves_by = message.policy
        if self._under_way and message.stage == PolicyStatus.MOVING and begins_ns:
            self.begins_ns = self.begins_ns or begins_ns
            if message.filtered:
                self.kept_ns = self._node.now_ns()

    @property
    def settled(self) -> bool:
        """Whether all has come that is due at this moment."""
        if self._asked is not None:
            return bool(self._asked.done())
        if self._ending is not None and not self._ending.done():
            return False
        due = self._result is not None and self.begins_ns and self._stage not in _MOVES
        return not due or bool(self._result.done())

    def not_ready(self) -> str:
        """Why the policy node takes no policy yet: it is not there, or not free; empty: it does."""
        if self._stage in _MOVES and self._node.now_ns() - self._heard_ns <= _MOVES_NS:
            # As when who sent it was killed: a policy is taken by a node that moves nothing.
            return "the policy node still moves the robot"
        if not self._load.service_is_ready():
            return "policy/load_model is not there"
        return "" if self._reach.server_is_ready() else "policy/reach_target is not there"

    def has(self, policy: DmpPolicy, note: int) -> bool:
        """Whether the policy node has taken a policy, which it is asked to if it has not.

        Args:
            policy: The policy.
            note: Number of the trial, for the file.

        Raises:
            GraphError: when it did not answer, or did not take it.
            HriError: when the file cannot be written.
        """
        if self._loaded is policy:
            return True
        if self._asked is None:
            write_whole({self._file: lambda path: save_dmp(path, policy, {"trial": note})})
            self._ask(self._load.call_async(LoadModel.Request(path=str(self._file))))
            self._loading = policy
        answer = self._answer("policy/load_model")
        if answer is None:
            return False
        if not answer.success:
            raise GraphError(f"the policy node did not take the policy: {answer.message}")
        # Another one may be wanted by now than was asked for.
        self._loaded, self._loading = self._loading, None
        return self._loaded is policy

    def send(self, place: NDArray[Any], duration: float) -> None:
        """Send the tool to a place (3,) [m] in a time [s]."""
        goal = ReachTarget.Goal(duration=duration)
        goal.pose.header.frame_id = WORLD
        position = goal.pose.pose.position
        position.x, position.y, position.z = (float(value) for value in place)
        self.begins_ns, self.kept_ns, self._under_way = None, None, True
        self._moves_by = ""
        self._handle = self._result = self._ending = None
        self._ask(self._reach.send_goal_async(goal))
        self._heard_ns = self._asked_ns

    def arrived(self) -> bool:
        """Whether the motion that was sent is over as it should; false: it goes on.

        Raises:
            GraphError: when it ended before it reached its goal though nobody asked it to, or the policy
                node is gone, or says nothing of it any more.
        """
        if self._result is None:
            handle = self._answer("policy/reach_target")
            if handle is None:
                return False
            if not handle.accepted:
                raise GraphError("policy/reach_target refused the goal")
            self._handle, self._result = handle, handle.get_result_async()
        if not self._result.done():
            if not self._reach.server_is_ready():
                raise GraphError("the policy node is gone")
            # A node that was killed seems to be there for some seconds, and one in its stead by then.
            if self._node.now_ns() - self._heard_ns > ANSWER_S * NANO:
                raise GraphError(
                    f"the policy node has said nothing of the motion for {ANSWER_S:.0f} s",
                    hint="it was started again, or hangs",
                )
            return False
        answer, self._result = self._result.result(), None
        self._under_way = False
        if self._moves_by not in ("", str(self._file)):
            raise GraphError(
                f"the policy node moved by {self._moves_by}",
                expected=str(self._file),
                hint="it was started again, or another policy was loaded into it",
            )
        # Who was asked to end may have given up a moment before.
        ended = self._ending is not None and answer.result.outcome in _ENDED
        if answer.status != GoalStatus.STATUS_SUCCEEDED and not ended:
            raise GraphError(str(answer.result.reason))
        return True

    def end(self) -> None:
        """Ask the motion under way to end where it is; again if that was refused."""
        if self._result is None or self._result.done():
            return
        refused = (
            self._ending is not None
            and self._ending.done()
            and not self._ending.result().goals_canceling
        )
        if self._ending is None or refused:
            self._ending = self._handle.cancel_goal_async()

    def forget(self) -> None:
        """What was asked for does not count any more; a motion under way is to end."""
        if self._result is not None and not self._result.done():
            self._handle.cancel_goal_async()
        if self._asked is not None and self._under_way and self._loading is None:
            # A goal that is taken later than anybody waits for it must not move the robot.
            self._asked.add_done_callback(_cancel)
        self._asked = self._handle = self._result = self._ending = None
        self._loaded = self._loading = None
        self._under_way = False

    def _ask(self, future: Any) -> None:
        self._asked, self._asked_ns = future, self._node.now_ns()

    def _answer(self, whose: str) -> Any:
        """What was answered; none: nothing yet."""
        if not self._asked.done():
            if self._node.now_ns() - self._asked_ns > ANSWER_S * NANO:
                raise GraphError(f"{whose} did not answer within {ANSWER_S:.0f} s")
            return None
        answer, self._asked = self._asked.result(), None
        return answer


def _cancel(sent: Any) -> None:
    """Cancel a goal as soon as it is known."""
    handle = sent.result()
    if handle is not None and handle.accepted:
        handle.cancel_goal_async()
