"""What the predictor's node says of a simulated person is what the predictor says offline."""

from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from motions import PREDICTION

from hri_prediction.bags.arms import sample_of
from hri_prediction.bags.predictions import prediction_of
from hri_prediction.evaluation.comparison import compare
from hri_prediction.prediction import ReachPredictor, TaskLibrary
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue


def test_the_node_says_the_same_as_offline(graph: Graph, scenario: Scenario, library: Path) -> None:
    status: dict[str, str] = {}

    def note(message: DiagnosticArray) -> None:
        for item in message.status:
            if item.name.endswith("predictor"):
                status.update({value.key: value.value for value in item.values})

    graph.nodes["person"].create_subscription(DiagnosticArray, "/diagnostics", note, 10)
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
    # And so are the figures of how good it was; those on /diagnostics are up to a second older.
    health = graph.nodes["predictor"].health()[2]
    figures = predictor.live_figures()
    assert list(figures) == [0.1, 0.2, 0.5]
    for horizon_s, at in figures.items():
        key = f"person1 {horizon_s:g} s"
        assert health[f"{key} n"] == at.n > 20
        assert float(health[f"{key} error_median_m"]) == pytest.approx(at.error_median_m, abs=5e-5)
        assert float(health[f"{key} coverage95"]) == pytest.approx(at.coverage95, abs=5e-4)
        assert 0 < int(status[f"{key} n"]) <= at.n
        assert (
            0.0 <= float(status[f"{key} coverage50"]) <= float(status[f"{key} coverage95"]) <= 1.0
        )
        assert np.isfinite(
            [float(status[f"{key} {name}"]) for name in ("error_mean_m", "nll")]
        ).all()
    assert 0.0 < float(status["latency_ms_p50"]) <= float(status["latency_ms_p99"])
    # Also where it was not there from the start: 13 samples are no whole number of its periods.
    late = compare("person1", predictions[20:], samples[13:], predictor, len(samples))
    assert late.same
