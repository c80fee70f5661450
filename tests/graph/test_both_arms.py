"""A body with two arms: each is predicted, planned around and waited for on its own."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tampering import BothArms

from hri_prediction.nodes.predictor_node import PredictorNode
from hri_prediction.ros.messages import HumanPrediction, LoadModel
from hri_prediction.ros.node import ERROR, OK
from hri_prediction.ros.time import to_ns
from hri_sim.testing import Graph, node_factory
from hri_sim.testing.spoiling import STILL

RIGHT = STILL - np.array([0.0, 0.3, 0.0])
BOTH = {"left": STILL, "right": RIGHT}
PREDICTION = "/humans/bodies/ann/prediction"


@pytest.fixture
def predicted() -> Iterator[Graph]:
    with Graph([node_factory(BothArms, BOTH), PredictorNode], timeout_s=5.0) as graph:
        graph.run(0.3)
        yield graph


def newest(graph: Graph, side: str) -> HumanPrediction:
    return [message for message in graph.messages(PREDICTION) if message.side == side][-1]


def test_each_arm_of_a_body_is_predicted(predicted: Graph) -> None:
    for side, keypoints in BOTH.items():
        message = newest(predicted, side)
        assert message.state == HumanPrediction.IDLE
        mean = np.array(message.mean).reshape(-1, 4, 3)
        np.testing.assert_allclose(mean, np.broadcast_to(keypoints, mean.shape), atol=1e-9)
    sides = [message.side for message in predicted.messages(PREDICTION)]
    assert sides.count("left") == sides.count("right") > 10
    level, text, figures = predicted.nodes["predictor"].health()
    assert (level, text) == (OK, "ann left idle; ann right idle")
    assert figures["ann left samples"] == figures["ann right samples"] > 50
    assert not any("side changed" in name for name in figures)


def test_markers_of_both_arms_stand_beside_each_other(predicted: Graph) -> None:
    markers = predicted.messages("/humans/markers")[-1].markers
    assert len({(marker.ns, marker.id) for marker in markers}) == len(markers) == 2 * (1 + 8)
    ends = {
        marker.ns: marker.points[-1].y for marker in markers if marker.type == marker.LINE_STRIP
    }
    assert ends == pytest.approx({"ann left/arm": 0.31, "ann right/arm": 0.01})


def test_an_arm_that_falls_silent_is_invalid_and_the_other_is_not(predicted: Graph) -> None:
    source = predicted.nodes["both_arms"]
    assert isinstance(source, BothArms)
    del source.seen["left"]
    predicted.run(0.5)
    assert newest(predicted, "left").state == HumanPrediction.INVALID
    assert newest(predicted, "right").state == HumanPrediction.IDLE
    level, text, _ = predicted.nodes["predictor"].health()
    assert level == ERROR
    assert text.startswith("ann left invalid: no usable sample")
    assert text.endswith("; ann right idle")
    source.seen["left"] = STILL
    predicted.run(0.1)
    assert newest(predicted, "left").state == HumanPrediction.IDLE


def test_one_arm_has_the_name_of_its_body() -> None:
    with Graph([node_factory(BothArms, {"left": STILL}), PredictorNode], timeout_s=5.0) as graph:
        graph.run(0.3)
        _, text, figures = graph.nodes["predictor"].health()
        assert text == "ann idle"
        assert figures["ann samples"] > 50
        assert {m.ns for m in graph.messages("/humans/markers")[-1].markers} == {
            "ann/arm",
            "ann/prediction",
        }


def test_another_library_is_for_both_arms(predicted: Graph, library: Path) -> None:
    predictor = predicted.nodes["predictor"]
    assert isinstance(predictor, PredictorNode)
    response = predictor._on_load_model(LoadModel.Request(path=str(library)), LoadModel.Response())
    assert response.success, response.message
    predicted.run(0.1)
    for side in BOTH:
        message = newest(predicted, side)
        assert (message.library, len(message.tasks) > 0) == (str(library), True)
        assert to_ns(message.header.stamp) > 0
