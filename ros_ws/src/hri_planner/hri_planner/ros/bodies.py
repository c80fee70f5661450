"""The predictions of the bodies that are tracked: who they are, and what is heard of them."""

from __future__ import annotations

from hri_planner.ros.inputs import Inputs
from hri_prediction.arm.body_id import valid_body_id
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import HumanPrediction, IdsList
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable


class Bodies:
    """Listens to the prediction of every tracked body.

    Args:
        node: Subscribes; faults are said by it.
        inputs: Where predictions go, once they have been checked.
    """

    def __init__(self, node: HriNode, inputs: Inputs) -> None:
        self._node = node
        self._inputs = inputs
        self._topics: dict[str, str] = {}

    def take(self, message: IdsList) -> None:
        """Take who is tracked now; what is known of others is forgotten.

        A body whose name no topic can have stays tracked without a prediction, so that the robot stops.
        """
        for body_id in [known for known in self._topics if known not in message.ids]:
            self._node.ignore(self._topics.pop(body_id))
            self._inputs.forget_body(body_id)
        for body_id in message.ids:
            if body_id in self._topics:
                continue
            if not valid_body_id(body_id):
                self._node.fault(
                    "bodies", f"body {body_id!r} is tracked, and no topic has such a name"
                )
                continue
            self._topics[body_id] = topic = f"humans/bodies/{body_id}/prediction"
            self._node.listen(HumanPrediction, topic, self._on_prediction, reliable(1))
        self._inputs.tracked = tuple(message.ids)

    def _on_prediction(self, message: HumanPrediction) -> None:
        try:
            self._inputs.take_prediction(message)
        except DataError as error:
            self._node.fault("prediction", str(error))
