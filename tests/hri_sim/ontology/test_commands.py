"""The command lines of the ontology, in their short forms."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.costs import COSTS
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.options import run_app
from hri_sim.ontology import costs_command, evaluation_command, training_command
from hri_sim.ontology.data import simulated_table
from hri_sim.ontology.sessions import DyadStudy, sessions_of


@pytest.fixture(scope="module")
def segments(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few sessions of three cases."""
    folder = tmp_path_factory.mktemp("segments")
    study = DyadStudy(encounters=3)
    chosen = [s for s in sessions_of(study, 0) if s.subject in ("s1", "s2") and s.case in (1, 2, 3)]
    table = simulated_table(chosen, study, folder, 2, lambda done, of: None)
    table.save(folder / "segments.npz")
    return folder / "segments.npz"


def run(command: object, *arguments: object) -> int:
    return run_app(command.app, "x.py", [str(argument) for argument in arguments])  # type: ignore[attr-defined]


def test_segments_are_made_once(segments: Path) -> None:
    files = sorted(segments.parent.glob("segments_*.npz"))
    assert len(files) == 1
    table = SegmentTable.load(segments)
    # Three movements of either; one that gives way may be cut into two.
    assert 2 * 9 * 6 <= len(table) <= 1.2 * 2 * 9 * 6
    assert set(table.case.tolist()) == {1, 2, 3}


def test_training(segments: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(training_command, "--data", segments, "--out", out, "--runs", tmp_path) == 0
    model = InteractionClassifier.load(out / "interaction_cases.npz")
    assert model.classes.tolist() == [1, 2, 3]
    told = json.loads((out / "results.json").read_text())
    assert 0.0 <= told["left_out"]["recognised"] <= 1.0
    assert sum(row["segments"] for row in told["left_out"]["calibration"]) > 20
    assert "recognised" in (out / "training.md").read_text()
    assert "3 cases, 1" in capsys.readouterr().out


def test_evaluation(segments: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = (
        "--data",
        segments,
        "--out",
        tmp_path / "out",
        "--runs",
        tmp_path,
        "--repetitions",
        2,
        "--live",
        0,
        "--smoke",
    )
    assert run(evaluation_command, *arguments) == 0
    told = json.loads((tmp_path / "out" / "results.json").read_text())
    assert told["counts"] == [512, 68, 20, 7]
    assert set(told["location_invariance"]) == {"case_1", "case_2", "case_3"}
    assert set(told["location_invariance"]["case_1"]) == {"frontal", "orthogonal", "same side"}
    assert told["subjects"] == ["s1", "s2"]
    assert told["piirl_cosine"] > 0.9
    for name in ("intra", "subject_vs_group", "group_vs_subject"):
        assert len(told[name]) == 2
    for labels in ("full", "reduced"):
        assert 0.0 < told[labels]["by_subject"] <= 1.0
    text = (tmp_path / "out" / "ontology.md").read_text()
    assert "thesis, human data, random halves" in text
    for name in ("confusion_full.png", "confusion_reduced.png"):
        assert (tmp_path / "out" / name).exists()
    kept = len(list(tmp_path.glob("splits_*/*.json")))
    assert kept == 2 * 2 + 2 + 2 * 2 + 2 + 2
    # Again: nothing is done twice.
    before = {path: path.stat().st_mtime_ns for path in tmp_path.glob("splits_*/*.json")}
    assert run(evaluation_command, *arguments) == 0
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.glob("splits_*/*.json")}
    assert "by subject" in capsys.readouterr().out


def test_learning_costs(tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ("--case", 2, "--smoke", "--samples", 10)
    assert run(costs_command, "--out", out, *arguments) == 0
    found = load_costs(out / "costs.json")
    assert list(found.cases) == ["case_2"]
    assert found.cases["case_2"].movements >= 12
    assert np.isfinite(found.cases["case_2"].weights).all()
    assert (out / "costs.png").stat().st_size > 10_000
    assert "case_2" in (out / "costs.md").read_text()
    # With the trunk as it was nothing can be learnt of where the shoulder is.
    assert run(costs_command, "--out", tmp_path / "arm", "--joints", "arm", *arguments) == 0
    arm = load_costs(tmp_path / "arm" / "costs.json")
    assert "arm alone" in arm.about
    shoulders = [k for k, name in enumerate(COSTS) if name.startswith("shoulder-")]
    assert (arm.cases["case_2"].weights[shoulders] == 0.0).all()


@pytest.mark.parametrize(
    ("command", "arguments", "said"),
    [
        (training_command, ("--data", "nowhere.npz"), "--data nowhere.npz: cannot read"),
        (training_command, ("--data", "nowhere"), "sessions"),
        (evaluation_command, ("--data", "nowhere.yaml"), "--data nowhere.yaml"),
        (costs_command, ("--case", "21"), "1 to 20"),
        (costs_command, ("--data", "nowhere"), "nowhere"),
        (costs_command, ("--joints", "legs"), "one of all, arm"),
    ],
)
def test_what_is_wrong_is_said(
    command: object, arguments: tuple[str, ...], said: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert run(command, *arguments, "--out", tmp_path / "out") == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert said in error
    assert error.count("\n") == 1
