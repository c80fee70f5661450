"""Lines of models damage and mix up all there are, and notice a reader that takes anything."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import hri_planner
import hri_prediction
from hri_prediction.errors import DataError
from hri_sim.faults import models
from hri_sim.faults.models import (
    damaged,
    learnt_models,
    readers,
    same,
    shipped_models,
    wrong_kinds,
)
from hri_sim.reliability.damage import digit_changed
from hri_sim.reliability.fault import Place

NO_MODELS = {"adaptation_f8.json"}
"""What says how others came about."""


def test_all_that_ship_are_damaged() -> None:
    roots = (Path(package.__file__ or "").parent for package in (hri_planner, hri_prediction))
    folders = [root / name for root in roots for name in ("models", "hybrid")]
    found = [file for folder in folders if folder.is_dir() for file in folder.iterdir()]
    files = {file.name for file in found if file.suffix in (".npz", ".json")}
    assert {model.path.name for model in shipped_models()} == files - NO_MODELS


def test_each_is_taken_by_its_own_reader(tmp_path: Path) -> None:
    known = {load for _, load, _ in readers()}
    for model in (*shipped_models(), *learnt_models(tmp_path)):
        assert model.load in known
        assert same(model.load(model.path), model.load(model.path))


def test_a_reader_that_takes_anything_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = [("a.npz", lambda path: None, frozenset()), ("b.npz", _unclear, frozenset())]
    own.append(("c.npz", lambda path: 1 / 0, frozenset()))
    monkeypatch.setattr(models, "readers", lambda: own)
    (trial,) = wrong_kinds([0], Place(tmp_path, tmp_path))
    count = len(shipped_models()) + 3
    expected = {"taken": count, "unclear": count, "other_errors": count, "pairs": 3 * count}
    assert trial.figures == expected


def _unclear(path: Path) -> None:
    raise DataError(f"{path.name} is bad")


def test_figures_that_are_altered_unnoticed_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"a": 1234567.5}))
    plain = models.Model(path, lambda path: json.loads(path.read_text()))
    monkeypatch.setattr(models, "shipped_models", lambda: [plain])
    monkeypatch.setattr(models, "learnt_models", lambda folder: [])
    (trial,) = damaged([0], Place(tmp_path, tmp_path), digit_changed, ".json")
    found = trial.figures
    assert found["refused"] == 0.0
    assert (found["altered"] or 0.0) + (found["other_errors"] or 0.0) == models.TOGETHER
    assert (found["altered"] or 0.0) > models.TOGETHER / 2


def test_what_is_the_same() -> None:
    assert same({"a": [np.array([1.0, np.nan])]}, {"a": [np.array([1.0, np.nan])]})
    assert not same({"a": [np.array([1.0])]}, {"a": [np.array([2.0])]})
    assert not same(1, 1.0)
