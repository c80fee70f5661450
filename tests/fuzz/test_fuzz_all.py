"""All that reads plain values or arrays is among the readers that are fuzzed, or it says why not."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2] / "ros_ws" / "src"
READERS = {
    "read_json", "parse_json", "read_yaml", "parse_yaml", "read_npz", "read_arrays", "parse_arrays",
}  # fmt: skip
FUZZED = {
    "hri_planner.adaptation.model_file",
    "hri_planner.dmp.model_file",
    "hri_planner.pibb.experiment_file",
    "hri_planner.pibb.storage",
    "hri_planner.policy.model_file",
    "hri_planner.rnn.model_file",
    "hri_planner.rnn.training.state",
    "hri_prediction.bags.metadata",
    "hri_prediction.bags.reader",
    "hri_prediction.config",
    "hri_prediction.files.arrays",
    "hri_prediction.files.values",
    "hri_prediction.hybrid.fit_command",
    "hri_prediction.hybrid.store",
    "hri_prediction.hybrid.weight_file",
    "hri_prediction.ontology.classifier",
    "hri_prediction.ontology.cost_file",
    "hri_prediction.ontology.recordings",
    "hri_prediction.ontology.table",
    "hri_prediction.prediction.library",
    "hri_prediction.promp.storage",
    "hri_prediction.tracks.files",
    "hri_prediction.tracks.labels",
    "hri_sim.launch.parameters",
    "hri_sim.ontology.handovers",
    "hri_sim.policies.handovers",
    "hri_sim.scenario.schema",
}
"""Modules with a reader in ``fuzz_readers``."""
OWN = "kept results, which the program that reads them has written"
NOT_FUZZED = {
    "hri_prediction.evaluation.run": OWN,
    "hri_prediction.motor_control.analyses.table": OWN,
    "hri_prediction.results.used": "whether settings are those of now: a comparison on top of the JSON",
    "hri_sim.launch.adapt": "a value on the command line, read as all YAML is",
    "hri_sim.launch.draw": "the summary of a run: a check of three lines on top of the JSON",
    "hri_sim.ontology.layout_file": "the file that ships",
    "hri_sim.readability_report.run_folder": OWN,
    "hri_sim.recording.provenance": "what a launcher hands to its recorder, kept as it is",
}


def readers() -> Iterator[str]:
    """Modules that call one of :data:`READERS`."""
    for path in sorted(ROOT.glob("hri_*/hri_*/**/*.py")):
        tree = ast.parse(path.read_text())
        called = {
            node.func.id
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        }
        if called & READERS:
            yield ".".join(path.relative_to(ROOT).with_suffix("").parts[1:])


def test_every_reader_is_fuzzed_or_says_why_not() -> None:
    found = set(readers())
    assert found == FUZZED | NOT_FUZZED.keys()
