"""What the predictor's node says of a simulated person is what the predictor says offline."""

from pathlib import Path

from motions import PREDICTION

from hri_prediction.bags.arms import sample_of
from hri_prediction.bags.predictions import prediction_of
from hri_prediction.evaluation.comparison import compare
from hri_prediction.prediction import ReachPredictor, TaskLibrary
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue


def test_the_node_says_the_same_as_offline(graph: Graph, scenario: Scenario, library: Path) -> None:
    graph.run(0.4)
    cue(graph, scenario, 0)
    graph.run(2.0)
    samples = [sample_of(m) for m in graph.messages("/humans/bodies/person1/arm")]
    predictions = [prediction_of(m) for m in graph.messages(PREDICTION)]
    predictor = ReachPredictor(TaskLibrary.load(library))
    found = compare("person1", predictions, samples, predictor, len(samples))
    assert found.same
    assert found.predictions > 100
    assert found.reaching > 30
    assert found.invalid == 0
    # Also where it was not there from the start: 13 samples are no whole number of its periods.
    late = compare("person1", predictions[20:], samples[13:], predictor, len(samples))
    assert late.same
