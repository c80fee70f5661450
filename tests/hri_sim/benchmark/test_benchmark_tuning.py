"""Tuning: as many trials for each planner, on tuning tasks, best first."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hri_sim.benchmark import tuning_command
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.benchmark.tuning import GRIDS, plans, rows, score

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("grid", GRIDS, ids=lambda grid: grid.planner)
def test_each_planner_gets_nine_cells_that_differ_in_two_settings(grid):
    assert len({cell.name for cell in grid.cells}) == 9
    base = PLANNERS[grid.planner]
    for cell in grid.cells:
        changed = {
            name for name, value in vars(cell.config).items() if value != getattr(base.config, name)
        }
        assert changed <= {"margin", "margin_min", grid.setting, "kappa_min"}
        assert cell.observer == base.observer
    for plan in plans(grid, seed=0, smoke=False).values():
        assert (plan.split, len(plan.tasks), plan.conditions) == ("tuning", 30, 3)
    margin, value = grid.shipped()
    assert any(
        cell.config.margin == margin and getattr(cell.config, grid.setting) == value
        for cell in grid.cells
    ), "what ships was never tried"


@pytest.mark.parametrize("grid", GRIDS[1:], ids=lambda grid: grid.planner)
def test_peers_ship_with_the_best_that_was_found(grid):
    found = json.loads((ROOT / "docs" / "results" / "tuning.json").read_text())
    best = found["planners"][grid.planner]["cells"][0]["cell"]
    margin, value = grid.shipped()
    assert best == f"{grid.planner}: margin {100.0 * margin:g} cm, {grid.setting} {value:g}"


def _figures(two, five, late):
    return {"ok": 1.0, "clearance_2cm": two, "clearance_5cm": five, "time_to_goal_s": late}


def test_clearance_counts_first_then_time():
    assert score([_figures(0.9, 0.5, 1.5)]) > score([_figures(0.8, 0.9, 1.2)])
    assert score([_figures(0.9, 0.6, 1.9)]) > score([_figures(0.9, 0.5, 1.2)])
    assert score([_figures(0.9, 0.5, 1.2)]) > score([_figures(0.9, 0.5, 1.9)])
    assert score([_figures(0.9, 0.5, 1.2)]) > score([_figures(0.9, 0.5, None)])
    machine = {"planners": {"a": _figures(0.5, 0.1, 1.0), "b": _figures(0.7, 0.1, 1.0)}}
    assert [row["cell"] for row in rows({1.0: machine})] == ["b", "a"]
    machine["planners"]["c"] = _figures(0.0, 0.0, None)
    json.dumps(rows({1.0: machine}), allow_nan=False)


def test_smoke_writes_a_table_and_does_nothing_twice(tmp_path, monkeypatch):
    monkeypatch.setattr(tuning_command, "GRIDS", GRIDS[1:2])
    arguments = ["--smoke", "--rows", str(tmp_path), "--workers", "1"]
    for _ in range(2):
        with pytest.raises(SystemExit) as stop:
            tuning_command.app(arguments)
        assert not stop.value.code
        monkeypatch.setattr("hri_sim.benchmark.rows.do_all", None)
    content = json.loads((tmp_path / "tuning.json").read_text())
    assert list(content["planners"]) == ["itomp"]
    text = (tmp_path / "tuning.md").read_text()
    assert "\n## `itomp`\n" in text
    assert "| margin 7 cm, margin_growth 0.02 |" in text
