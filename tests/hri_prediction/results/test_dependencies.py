"""What a module depends on: results are kept while none of it changes."""

from __future__ import annotations

import pytest

from hri_prediction.results import dependencies as module
from hri_prediction.results.dependencies import dependencies, dependency_hash


def test_what_is_imported_counts_and_nothing_else():
    found = dependencies("hri_sim.benchmark.run")
    for name in (
        "hri_sim.benchmark.run",
        "hri_sim.benchmark.learning",
        "hri_planner.ptomp.planner",
        "hri_planner.ptomp.kernel",
        "hri_prediction.prediction.predictor",
        "hri_prediction.promp",
        "hri_sim.simulator.controller",
    ):
        assert name in found, name
    for name in (
        "hri_sim.benchmark.report",
        "hri_sim.media.picture",
        "hri_planner.nodes.ptomp_node",
    ):
        assert name not in found, name
    assert all(path.suffix == ".py" for path in found.values())


def test_a_module_that_there_is_not_is_named():
    with pytest.raises(ModuleNotFoundError, match=r"hri_sim\.nothing"):
        dependencies("hri_sim.nothing")


def test_the_hash_changes_with_what_it_depends_on(tmp_path, monkeypatch):
    used, other = tmp_path / "used.py", tmp_path / "other.py"
    start = tmp_path / "start.py"
    start.write_text("def work():\n    from hri_sim.used import thing\n    return thing\n")
    used.write_text("thing = 1\n")
    other.write_text("thing = 2\n")
    files = {"hri_sim": tmp_path / "__init__.py"}
    files["hri_sim"].touch()
    files |= {f"hri_sim.{path.stem}": path for path in (start, used, other)}
    monkeypatch.setattr(module, "_source", files.get)
    hashed = dependency_hash.__wrapped__
    before = hashed("hri_sim.start")
    other.write_text("thing = 3\n")
    assert hashed("hri_sim.start") == before
    used.write_text("thing = 4\n")
    after = hashed("hri_sim.start")
    assert after != before
    (tmp_path / "robot.urdf").write_text("<robot/>")
    assert hashed("hri_sim.start") != after
