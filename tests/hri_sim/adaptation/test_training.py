"""Training of adaptation: the design, samples that are kept, and the command from end to end."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from hri_planner.adaptation.algorithm1 import FILTERS, RULES, Label
from hri_planner.adaptation.gpr_selection import fit_gpr
from hri_planner.adaptation.grid import CELLS, SHAPE, Cell
from hri_planner.adaptation.model_file import load_model
from hri_planner.adaptation.origin import planner_hash
from hri_planner.ptomp.situation import Situation
from hri_prediction.errors import ConfigError, DataError
from hri_sim.adaptation import command, samples, training
from hri_sim.adaptation.design import SPLIT, Design, Trial
from hri_sim.adaptation.samples import Sample, gather, setup_of
from hri_sim.adaptation.training import Labelled, leave_one_task_out
from hri_sim.benchmark import rows
from hri_sim.benchmark.adapted import TRAINED_AT
from hri_sim.benchmark.outcome import Outcome

DESIGN = Design(64.0, (0, 1), grid_conditions=2, conditions=3, cells=2)


def test_the_design_keeps_to_tuning_tasks_and_holds_a_fifth_out():
    assert SPLIT == "tuning"
    assert len(DESIGN.held_out) == 6
    assert {task % 5 for task in DESIGN.held_out} == {0, 1, 2, 3, 4}
    assert sorted(DESIGN.held_out + DESIGN.learnt) == list(DESIGN.tasks)
    assert [job.unit for job in DESIGN.random_jobs()] == list(
        {job.unit: 0 for job in DESIGN.random_jobs()}
    )
    grid = DESIGN.grid_jobs()
    assert len(grid) == 2 * len(DESIGN.learnt) == 48
    assert not {job.unit.task for job in grid} & set(DESIGN.held_out)
    assert all([trial.cell for trial in job.trials] == list(CELLS) for job in grid)
    more = replace(DESIGN, seeds=(0, 1, 2))
    assert set(DESIGN.random_jobs()) < set(more.random_jobs())


def test_a_coarse_grid_stands_for_all():
    coarse = replace(DESIGN, grid_step=5)
    assert len(coarse.grid_cells) == 9
    found = [made(0, cell, control=float(cell.num_timesteps)) for cell in coarse.grid_cells]
    values = training._over_grid(found, "control")
    assert values.shape == SHAPE
    assert values[0, 0] == 10.0
    assert values[1, 11] == 10.0
    assert values[-1, 0] == 60.0


def made(condition, cell, *, ok=True, clearance=0.1, control=100.0):
    return Sample(
        condition, cell.num_timesteps, cell.num_rollouts, 0.02, 0.01, 0.2, 0.7, 10.0 + condition,
        ok, clearance, 0.0 if ok else 0.3, control, 100,
    )  # fmt: skip


def test_collision_cost_is_what_is_missing():
    assert made(0, CELLS[0]).collision == 0.0
    assert made(0, CELLS[0], clearance=0.015).collision == pytest.approx(0.005)
    assert made(0, CELLS[0], ok=False).collision == pytest.approx(0.3)


def test_a_success_keeps_its_distance():
    assert made(0, CELLS[0], clearance=0.05).success
    assert not made(0, CELLS[0], clearance=0.049).success
    assert not made(0, CELLS[0], ok=False, clearance=0.1).success


@pytest.fixture
def simulated(monkeypatch):
    """Motions that take no time: they succeed when TS suits the task."""
    asked = []

    def run_episode(condition, setup, library, *, slowdown, seed):
        config = setup.config
        asked.append((condition, config.num_timesteps, config.num_rollouts, seed))
        rng = np.random.default_rng([condition, config.num_timesteps, config.num_rollouts, seed])
        ok = bool(rng.random() < 1.0 - config.num_timesteps / 100.0)
        return Outcome(
            0.05 if ok else -0.01, 0.05, 0.0, 0.0, 1.5, 0.5, 0.1,
            float(config.num_rollouts), 0.5, 10, 0, 100,
        )  # fmt: skip

    def start_situation(condition, observer, config, library, seed):
        rng = np.random.default_rng([condition, seed])
        return Situation(*rng.uniform(0.0, [0.05, 0.02, 0.5, 1.5, 50.0]))

    class Conditions:
        def __init__(self, task):
            self.conditions = tuple(100 * task + number for number in range(15))

    monkeypatch.setattr(samples, "run_episode", run_episode)
    monkeypatch.setattr(samples, "start_situation", start_situation)
    monkeypatch.setattr(samples, "task_conditions", lambda split, task: Conditions(task))
    monkeypatch.setattr(samples, "task_library", lambda split, task: None)
    monkeypatch.setattr(
        rows, "do_all", lambda work, items, **_: (work(item) for item in items)
    )  # fmt: skip
    return asked


def test_what_is_simulated_is_kept_unless_other_trials_are_asked_for(tmp_path, simulated):
    path, jobs = tmp_path / "rows.jsonl", replace(DESIGN, tasks=(0, 1)).random_jobs()
    first = gather(64.0, jobs, path)
    assert len(simulated) == 2 * 2 * 3 * 2
    assert gather(64.0, jobs, path) == first
    assert len(simulated) == 24
    changed = replace(jobs[0], trials=(Trial(2, CELLS[7]),))
    again = gather(64.0, [changed, *jobs[1:]], path)
    assert len(simulated) == 25
    (sample,) = again[changed.unit]
    assert (sample.condition, sample.cell) == (2, CELLS[7])
    gather(8.0, jobs, path)
    assert len(simulated) == 49


def test_the_adapted_planner_is_the_default_one_but_for_the_cell():
    config = setup_of(CELLS[3]).config
    assert (config.num_timesteps, config.num_rollouts) == (10, 20)


def test_the_command_from_end_to_end(tmp_path, simulated):
    out = tmp_path / "out"
    done = CliRunner().invoke(command.app, ["--out", str(out), "--smoke", "--workers", "1"])
    assert done.exit_code == 0, done.output
    results = json.loads((out / "results.json").read_text())
    assert sum(results["labels"].values()) == 4
    assert set(results["labels"]) == set(RULES)
    assert set(results["planners"]) == {"gpr", "gpr_lower", "success", "fixed", "default"}
    assert results["tasks"] == {"learnt": [4, 5], "held_out": [0]}
    assert results["label_sd"]["conditions"] == 4
    assert {row["iterations"] for row in results["planners"].values()} == {100.0}
    text = (out / "results.md").read_text()
    assert "than the best fixed cell" in text
    assert results["planners"]["fixed"]["success_less_fixed_ci95"] == [0.0, 0.0]
    assert "4.17" in text
    assert "100 iterations a motion at this F" in text
    for name in ("gpr", "gpr_lower", "success", "fixed"):
        assert load_model(out / f"{name}_f{TRAINED_AT}.npz").choose(
            Situation(0.02, 0.01, 0.2, 0.7, 10.0)
        )
    trained = json.loads((out / f"adaptation_f{TRAINED_AT}.json").read_text())
    assert (trained["budget"], trained["planner"]) == (TRAINED_AT, planner_hash())
    lower = load_model(out / f"gpr_lower_f{TRAINED_AT}.npz").less
    assert lower.tolist() == results["label_sd"]["gpr"]
    count = len(simulated)
    again = CliRunner().invoke(command.app, ["--out", str(out), "--smoke", "--workers", "1"])
    assert again.exit_code == 0
    assert len(simulated) == count
    assert json.loads((out / "results.json").read_text()) == results


def labels_of(tasks, cells):
    rng = np.random.default_rng(0)
    return [
        Labelled(task, rng.normal(size=5), Label(Cell(*cell), FILTERS))
        for task, cell in zip(tasks, cells, strict=True)
    ]


def test_labels_are_checked_in_tasks_that_were_left_out():
    labels = labels_of((1, 1, 2, 2, 3), ((10, 5), (20, 15), (30, 5), (40, 25), (60, 60)))
    errors = leave_one_task_out(labels)
    assert errors.gpr.shape == errors.mean.shape == (5, 2)
    assert errors.mean[0] == pytest.approx([130 / 3 - 10, 30 - 5])
    assert errors.mean[4] == pytest.approx([25 - 60, 12.5 - 60])
    others = [each for each in labels if each.task != 2]
    process = fit_gpr(
        np.array([each.features for each in others]), np.array([each.wanted for each in others])
    )
    assert errors.gpr[2] == pytest.approx(process.predict(labels[2].features) - [30, 5])
    assert errors.mean_sd == pytest.approx(errors.mean.std(axis=0))
    with pytest.raises(DataError, match="two at least"):
        leave_one_task_out(labels[:4:2])


def test_models_of_another_planner_are_named(tmp_path, simulated, monkeypatch):
    monkeypatch.setattr(command, "trained_for_another", lambda: ["gpr_f8"])
    arguments = ["--out", str(tmp_path / "out"), "--smoke", "--workers", "1"]
    done = CliRunner().invoke(command.app, arguments)
    assert "models that ship: Warning" in done.output
    assert "gpr_f8" in done.output


def test_wrong_options_are_one_line(tmp_path):
    with pytest.raises(ConfigError, match="--budget 7"):
        command.train_adaptation(out=tmp_path, budget=7)
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(ConfigError, match="cannot make --out"):
        command.run_design(DESIGN, file / "out", 1, None, command.Console())
