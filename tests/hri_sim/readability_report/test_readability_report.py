"""The report from experiments that are as small as they can be: it is whole, and goes on."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from hri_planner.pibb.costs import CostWeights
from hri_prediction.errors import ConfigError
from hri_prediction.results.origin import results_origin
from hri_sim.benchmark import workers
from hri_sim.readability_report import command, head_on, run_folder
from hri_sim.readability_report import report as report_module
from hri_sim.readability_report.bars import bars, lines
from hri_sim.readability_report.cases import A_3, CASES, TEACHER, A, B, chosen_cases
from hri_sim.readability_report.demonstrations import KINDS, imitation
from hri_sim.readability_report.field_gradient import field_gradient
from hri_sim.readability_report.intervals import estimate, is_below_zero, share, text
from hri_sim.readability_report.report import SECTIONS, report
from hri_sim.readability_report.run_folder import RunFolder
from hri_sim.readability_report.terms import fall_text
from hri_sim.readability_report.transfer import verdict
from hri_sim.readability_report.trials import COST, costs_in, shares, trials_of
from hri_sim.readability_report.work import Done, Job, do_job
from hri_sim.reproduction import drawing

FIGURES = {
    "seeds", "improved_share", "pred_time_change", "error_change", "contacts", "cost_first", "cost_last",
}  # fmt: skip


@pytest.fixture(scope="module")
def done() -> Done:
    return do_job(Job(A.name, 3, A.experiment(True), 1, None))


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures of few points, and no sources that a change of which makes results stale."""
    monkeypatch.setattr(drawing, "DPI", 30)
    monkeypatch.setattr(run_folder, "dependency_hash", lambda module: module)
    monkeypatch.setattr(workers, "compile_kernels", lambda: None)


def run(monkeypatch: pytest.MonkeyPatch, *options: object) -> int:
    arguments = ["reproduce_dmp.py", "--smoke", "--workers", "1", *map(str, options)]
    monkeypatch.setattr("sys.argv", arguments)
    with pytest.raises(SystemExit) as stop:
        command.main()
    return int(stop.value.code or 0)


def test_smoke_makes_everything_and_does_nothing_twice(
    small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    options = ("--runs", tmp_path / "runs", "--out", out, "--seeds", 1)
    assert run(monkeypatch, *options) == 0
    content, text = json.loads((out / "dmp.json").read_text()), (out / "dmp.md").read_text()
    assert list(content["experiments"]) == [case.name for case in CASES]
    assert all(set(one) == FIGURES for one in content["experiments"].values())
    assert all(one["seeds"] == 1 for one in content["experiments"].values())
    assert content["rollout_ms_batch24"] > 0.0
    assert 0.0 < content["imitation_rms_mm"] <= 0.5
    assert 0.0 < content["field_gradient_error"] <= 1e-6
    compared = json.loads((out / "results.json").read_text())
    assert compared == {name: content[name] for name in command.COMPARED}
    assert text == report(content)
    assert "nan" not in text
    assert "A smoke run" in text
    for section in SECTIONS:
        assert f"## {section.title}" in text
    names = [f"goal_g{number}" for number in range(1, 5)]
    names += ["finals", "course", "jerk", "transfer_cost", "transfer_time"]
    assert sorted(path.stem for path in (out / "dmp").iterdir()) == sorted(names)
    for name in names:
        assert f"](dmp/{name}.png)" in text
    assert "contacts in" in capsys.readouterr().out

    # A damaged file is done again, nothing else; other seeds are added. What takes its time is left out.
    found = content["sections"]["parts"]
    some = tuple(
        dataclasses.replace(one, measure=lambda laboratory: found) if one.name == "parts" else one
        for one in SECTIONS
        if one.name != "pictures"
    )
    for module in (command, report_module):
        monkeypatch.setattr(module, "SECTIONS", some)
    asked: list[tuple[str, int]] = []
    really = workers.do_all

    def watched(work, jobs, **options):
        asked.extend((job.case, job.seed) for job in jobs)
        return really(work, jobs, **options)

    monkeypatch.setattr(workers, "do_all", watched)
    assert run(monkeypatch, *options) == 0
    assert asked == []
    (broken,) = (tmp_path / "runs" / "transfer_b").rglob("seed_0.npz")
    broken.write_bytes(broken.read_bytes()[:100])
    assert run(monkeypatch, *options) == 0
    assert asked == [("transfer_b", 0)]
    again = json.loads((out / "dmp.json").read_text())
    assert again["experiments"] == content["experiments"]
    asked.clear()
    further = ("--first-seed", 1, "--experiments", "transfer_b")
    assert run(monkeypatch, *options, *further) == 0
    assert asked == [(TEACHER.name, 10_001), ("transfer_b", 1)]
    only = json.loads((out / "dmp.json").read_text())
    assert list(only["experiments"]) == ["transfer_b"]
    assert run(monkeypatch, *options[:4], "--seeds", 2, "--experiments", "transfer_b") == 0
    both = json.loads((out / "dmp.json").read_text())["experiments"]
    assert both["transfer_b"]["seeds"] == 2
    # Of experiments that were not asked for, what is there.
    assert both["transfer_a"]["seeds"] == 1


def test_results_are_read_as_they_were_written(small: None, done: Done, tmp_path: Path) -> None:
    folder, origin = RunFolder(tmp_path, True), results_origin()
    assert folder.read(A, 3) is None
    folder.add(A, done, origin)
    found = folder.read(A, 3)
    assert found is not None
    learnt, said = found
    assert said == origin
    assert folder.seeds(A) == [3]
    for name in (*run_folder.READ, "traits", "units", "results", "contacts", "seed"):
        assert getattr(learnt, name) == getattr(done.learnt, name)
    assert len(learnt.means) == A.experiment(True).improvement.updates + 1
    for mean, other in zip(learnt.means, done.learnt.means, strict=True):
        for goal in mean.names:
            np.testing.assert_array_equal(mean.path(goal), other.path(goal))
    path = folder.file(A, 3)
    path.write_text(path.read_text()[:-50])
    assert folder.read(A, 3) is None


def test_marks_tell_apart_what_decides(
    small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = RunFolder(tmp_path, False)
    marks = {case.name: folder.mark(case) for case in (A, A_3, B, TEACHER)}
    assert RunFolder(tmp_path / "elsewhere", False).mark(A) == marks[A.name]
    marks["smoke"] = RunFolder(tmp_path, True).mark(A)
    with monkeypatch.context() as other:
        other.setattr(run_folder, "READINGS", 7)
        marks["readings"] = RunFolder(tmp_path, False).mark(A)
    monkeypatch.setattr(run_folder, "dependency_hash", lambda module: "other sources")
    marks["sources"] = RunFolder(tmp_path, False).mark(A)
    assert len(set(marks.values())) == len(marks)


def test_who_begins_with_what_was_taught_begins_at_the_own_start(done: Done) -> None:
    experiment = TEACHER.experiment(True)
    learnt = do_job(Job(B.name, 0, experiment, 1, done.learnt.last)).learnt
    straight = experiment.initial_policy(head_on.load_robot())
    np.testing.assert_allclose(learnt.first.start, straight.start)
    for goal in experiment.goals:
        np.testing.assert_allclose(learnt.first.goals[goal], experiment.goals[goal])
        taught = done.learnt.last.weights[goal]
        scale = np.linalg.norm(learnt.first.weights[goal]) / np.linalg.norm(taught)
        ways = [
            float(np.linalg.norm(policy.goals[goal] - policy.start))
            for policy in (learnt.first, done.learnt.last)
        ]
        assert scale == pytest.approx(ways[0] / ways[1])


def test_shares_of_the_terms_make_the_costs(done: Done) -> None:
    experiment = A.experiment(True)
    trials, units = trials_of(done.learnt, experiment), done.learnt.units
    own = costs_in(trials, units, experiment.weights)
    np.testing.assert_allclose(own, trials.columns[COST])
    parts = shares(trials, units, experiment.weights)
    np.testing.assert_allclose(np.sum(list(parts.values()), axis=0), own)
    assert "indistinct" not in shares(trials, units, CostWeights(indistinct=0.0))
    plan = experiment.improvement
    assert trials.count == len(experiment.goals) * (plan.habituation + plan.updates * plan.rollouts)
    goals = [trials.by_update(own, goal) for goal in trials.goals]
    np.testing.assert_allclose(np.mean(goals, axis=0), trials.by_update(own))


def test_intervals() -> None:
    values = np.random.default_rng(0).normal(3.0, 1.0, 40)
    found = estimate(values)
    low, high = found["ci95"]
    assert low < found["mean"] < high
    assert high - low == pytest.approx(2.0 * 1.96 * values.std() / np.sqrt(40), rel=0.15)
    assert estimate(values[:4])["ci95"] is None
    assert estimate(np.zeros(30))["ci95"] is None
    assert estimate([])["mean"] is None
    # As Wilson's formula gives it for 9 of 10.
    assert share([True] * 9 + [False])["ci95"] == pytest.approx([0.5958, 0.9821], abs=1e-4)
    assert text({"mean": -0.001, "ci95": [-0.5, 0.25]}, 2, sign=True) == "0.00 (-0.50 to +0.25)"
    assert text(share([]), 1) == "–"
    assert is_below_zero({"ci95": [-2.0, -1.0]}) is True
    assert is_below_zero({"ci95": [1.0, 2.0]}) is False
    assert is_below_zero({"ci95": [-1.0, 2.0]}) is None
    assert is_below_zero({"ci95": None}) is None


def compared(low: float, high: float) -> dict:
    return {"difference": {"mean": 0.5 * (low + high), "ci95": [low, high]}}


@pytest.mark.parametrize(
    ("times", "errors", "said"),
    [
        ((-0.3, -0.1), (-0.2, 0.1), "B beats A"),
        ((-0.3, -0.1), (-0.1, 0.2), "B does not clearly beat A"),
        ((-0.3, -0.1), (0.1, 0.2), "B does not beat A"),
        ((-0.1, 0.1), (-0.1, 0.1), "neither sooner nor later"),
        ((0.1, 0.2), (-0.1, 0.1), "read later than A's"),
    ],
)
def test_the_verdict_is_what_the_intervals_say(times: tuple, errors: tuple, said: str) -> None:
    updates = {
        "prediction_time": {"first": compared(-0.3, -0.1), "last": compared(*times)},
        "task": {"last": compared(*errors)},
    }
    after = {"prediction_time": compared(*times), "error": compared(*errors)}
    found = verdict({"updates": updates, "readings": {"after": after}})
    assert "In the first update B is read sooner (-0.20 (-0.30 to -0.10) s)" in found
    assert said in found
    assert ("B beats A" in found) == (said == "B beats A")


def test_what_distinctness_makes_of_the_fall() -> None:
    falls = {"prediction_time": 1.0, "task": 0.5, "indistinct": 2.5, "tool_jerk": 1.0}
    assert fall_text(falls).startswith(
        "50 % of the fall; J_pred, J_task and J_dur together make 30 %"
    )
    assert "does not fall" in fall_text({**falls, "tool_jerk": -9.0})
    assert fall_text({"task": 1.0}) == "it has no weight"


def test_bars() -> None:
    one = {"seeds": 20, "improved": {"share": 0.95}, "contacts": 0, "all_trials": 100}
    sections = {
        "parts": {
            "rollouts": {"batch": 24, "median_ms": 3.0},
            "imitation": {"a": {"max_mm": 0.1}, "b": {"max_mm": 0.6}},
            "field": {"error": 1e-9},
            "head_on": [
                {"field": True, "reached": True, "clearance_m": 0.01},
                {"field": True, "reached": True, "clearance_m": 0.0},
                {"field": False, "reached": False, "clearance_m": 0.1},
            ],
            "singularities": {"a": {"speed_max_rad_s": 1.0, "error_max_mm": 0.5}},
        },
        "improvement": {A.name: one, TEACHER.name: one},
    }
    found = bars(sections)
    met = {bar.what.split(",")[0]: bar.met for bar in found}
    assert met["batch of 24 roll-outs"] is True
    assert met["imitation"] is False
    assert met["hands exactly in the way: goals reached"] is True
    assert met["hands exactly in the way: contacts"] is False
    assert [bar.met for bar in found if "J_pred falls" in bar.what] == [True]
    assert sum("trials" in bar.what for bar in found) == 2  # also of those who teach
    assert "**missed**" in "\n".join(lines(found))
    one["seeds"] = 19
    assert [bar.met for bar in bars(sections) if "J_pred falls" in bar.what] == [None]


def test_parts_are_as_exact_as_they_should_be() -> None:
    found = imitation(True)
    assert set(found) == set(KINDS)
    assert max(one["max_mm"] for one in found.values()) <= 0.5
    assert field_gradient(True)["error"] <= 1e-6


def test_a_hand_in_the_way_is_gone_around() -> None:
    found = head_on.head_on(True)
    assert len(found) == 8
    for one in found:
        assert one["reached"] == one["field"]
        assert one["clearance_m"] > 0.0


def test_experiments_are_chosen_by_name() -> None:
    assert chosen_cases("") == list(CASES)
    assert chosen_cases("transfer_b, transfer_a") == [A, B]
    with pytest.raises(ConfigError, match="--experiments nothing"):
        chosen_cases("nothing")
    assert A_3.experiment(False).improvement == dataclasses.replace(
        A.experiment(False).improvement, rollouts=3
    )


def test_a_folder_that_cannot_be_made_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("sys.argv", ["x", "--smoke", "--runs", str(tmp_path / "file" / "runs")])
    with pytest.raises(ConfigError, match="--runs"):
        command.main()
