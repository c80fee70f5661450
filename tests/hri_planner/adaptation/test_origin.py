"""Which planner the models that ship were trained for."""

import re
from dataclasses import replace

import pytest

from hri_planner.adaptation import model_file, origin
from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.grid import Cell
from hri_planner.adaptation.model_file import save_model, shipped_names, trained_with
from hri_planner.adaptation.origin import planner_hash, trained_for_another, unfit, warning
from hri_prediction.errors import ConfigError


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """A folder of two models, of which one was trained for another planner."""
    for name, planner in (("old", "0" * 16), ("new", planner_hash())):
        save_model(tmp_path / f"{name}.npz", BestFixed(Cell(20, 10)), {"planner": planner})
    save_model(tmp_path / "unsaid.npz", BestFixed(Cell(20, 10)), {})
    monkeypatch.setattr(model_file, "_folder", lambda: tmp_path)


def test_models_of_another_planner_are_found(shipped):
    assert shipped_names() == ["new", "old", "unsaid"]
    assert trained_with("old") == {"planner": "0" * 16}
    assert trained_for_another() == ["old", "unsaid"]
    assert trained_for_another(["new"]) == []
    assert "`old`, `unsaid`" in warning(trained_for_another())
    with pytest.raises(ConfigError, match="no_such"):
        trained_for_another(["no_such"])


def test_why_a_model_does_not_suit_a_planner(shipped, tmp_path):
    assert unfit("new", "ptomp") == ""
    assert unfit(str(tmp_path / "new.npz"), "ptomp") == ""
    assert "other settings" in unfit(str(tmp_path / "old.npz"), "ptomp")
    assert "not for stomp" in unfit("new", "stomp")


def test_the_hash_is_of_settings_and_sources(monkeypatch):
    present = planner_hash()
    assert re.fullmatch("[0-9a-f]{16}", present)
    config = origin.load_default_config()
    changed = replace(config, kappa=config.kappa + 0.01)
    monkeypatch.setattr(origin, "load_default_config", lambda: changed)
    assert planner_hash.__wrapped__() != present
    monkeypatch.undo()
    assert planner_hash.__wrapped__() == present
    monkeypatch.setattr(origin.resources, "files", lambda package: "/nowhere")
    assert planner_hash.__wrapped__() != present
