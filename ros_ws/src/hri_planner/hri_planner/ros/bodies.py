"""What is heard of each body that is tracked."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Protocol

from rclpy.qos import QoSProfile

from hri_planner.ros.inputs import Inputs
from hri_prediction.arm.body_id import valid_body_id
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import HumanPrediction, IdsList
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import PREDICTIONS
from hri_prediction.ros.tracked import take_list
from hri_prediction.tracked_lists import TrackedLists


class Followed(Protocol):
    """What knows who is tracked, and is told whom to forget."""

    lists: TrackedLists

    def forget_body(self, body_id: str) -> None:
        """Drop what is known of a body."""


class BodyTopics(ABC):
    """Listens to one topic of every tracked body.

    Args:
        node: Subscribes; faults are said by it.
        inputs: Knows who is tracked, and is told whom to forget.
    """

    what: ClassVar[str]
    """Last part of the topics' names, and kind of the faults."""
    message: ClassVar[type]
    qos: ClassVar[QoSProfile]

    def __init__(self, node: HriNode, inputs: Followed) -> None:
        self._node, self._followed = node, inputs
        self._topics: dict[str, str] = {}

    @abstractmethod
    def take_one(self, body_id: str, message: Any) -> None:
        """Take a message of a body.

        Raises:
            DataError: when it cannot be used.
        """

    def take(self, message: IdsList) -> None:
        """Take who is tracked now, as a source says; what is known of others is forgotten."""
        take_list(self._followed.lists, message, self._node.tick_ns)
        self.follow()

    def follow(self) -> None:
        """Listen to those who are tracked.

        A body whose name no topic can have stays tracked and unheard, so that the robot stops.
        """
        ids = self._followed.lists.ids or ()
        for body_id in [known for known in self._topics if known not in ids]:
            self.leave(body_id)
        for body_id in ids:
            if body_id in self._topics:
                continue
            if not valid_body_id(body_id):
                self._node.fault(
                    "bodies", f"body {body_id!r} is tracked, and no topic has such a name"
                )
                continue
            self._listen(body_id)

    def leave(self, body_id: str) -> None:
        """A body that was listened to is no longer listed: nothing of it counts any more."""
        self.unsubscribe(body_id)
        self._followed.forget_body(body_id)

    def unsubscribe(self, body_id: str) -> None:
        """Listen to a body no longer."""
        self._node.ignore(self._topics.pop(body_id))

    def _listen(self, body_id: str) -> None:
        def heard(message: Any) -> None:
            try:
                if message.body_id != body_id:
                    raise DataError(
                        f"{self.what} of {message.body_id!r} came on the topic of {body_id!r}"
                    )
                self.take_one(body_id, message)
            except DataError as error:
                self._node.fault(self.what, str(error))

        self._topics[body_id] = topic = f"humans/bodies/{body_id}/{self.what}"
        self._node.listen(self.message, topic, heard, self.qos)


class Bodies(BodyTopics):
    """Predictions of tracked bodies, which are checked before they are taken."""

    what, message, qos = "prediction", HumanPrediction, PREDICTIONS

    def __init__(self, node: HriNode, inputs: Inputs) -> None:
        super().__init__(node, inputs)
        self._inputs = inputs

    def take_one(self, body_id: str, message: HumanPrediction) -> None:
        """Take a prediction."""
        self._inputs.take_prediction(message)
