"""The benchmark of optimal control: its short run, its refusals, and the people it is about."""

import json

import numpy as np
import pytest
from rich.console import Console

from hri_prediction.errors import HriError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ANATOMICAL
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.ocp import NotConverged
from hri_prediction.results.progress import ProgressLine
from hri_sim.motor_control import benchmark_cases as cases
from hri_sim.motor_control import first_solve
from hri_sim.motor_control.benchmark_cases import SMOKE, Extent, chosen_tasks
from hri_sim.motor_control.benchmark_command import bars, main, measure
from hri_sim.motor_control.benchmark_laws import Compared, _pooled
from hri_sim.motor_control.people import REPETITIONS, draw_people, measured_arm, record, see

PARTS = {
    "ocp": [
        "n",
        "converged",
        "median_ms",
        "speedup_vs_multiple_shooting",
        "max_hand_gap_cm",
        "multistart_spread",
    ],
    "ioc": [
        "n",
        "alpha_error_median",
        "share_below_1e3",
        "solves_median",
        "seconds_median",
        "dtw_not_worse_share",
    ],
    "batch": ["n", "seconds"],
    "composite": ["n", "not_worse", "mean_dtw_cm", "ratio_best_single"],
    "law": ["r2_truth", "r2_single_reaches", "r2_single_whole"],
}
"""What ``results.json`` has at least."""


def test_short_run(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["--out", str(out), "--smoke", "--seed", "2"]) == 0
    results = json.loads((out / "results.json").read_text())
    for part, keys in PARTS.items():
        assert set(keys) <= results[part].keys()
    assert results["ocp"]["converged"] == results["ocp"]["n"] == SMOKE.tasks * SMOKE.mixes
    assert results["ocp"]["max_hand_gap_cm"] < 0.1
    assert results["ocp"]["multistart_spread"] < 1e-6
    assert results["ioc"]["share_below_1e3"] == 1.0
    assert results["batch"]["failed"] == 0
    assert results["composite"]["not_worse"] == results["composite"]["n"] == SMOKE.tasks
    report = (out / "results.md").read_text()
    assert "benchmark_ocp.py --seed 2 --smoke" in report
    assert len(bars(results)) == report.count("| met |") + report.count("| missed |")
    capsys.readouterr()
    assert main(["--out", str(out), "--smoke"]) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert not (out / ".benchmark_parts").exists()


def test_parts_that_are_measured_are_not_measured_again(tmp_path, monkeypatch):
    """Stopped in the last of them, as with Ctrl-C."""
    asked = []

    def part(name, stopped=False):
        def measured(*_):
            asked.append(name)
            if stopped:
                raise KeyboardInterrupt
            return {name: {"n": 1}}

        return measured

    monkeypatch.setattr(cases, "ocp_case", part("ocp"))
    monkeypatch.setattr(cases, "inverse_case", part("ioc"))
    monkeypatch.setattr(cases, "people_case", part("batch", stopped=True))
    progress = ProgressLine(Console(quiet=True))
    with pytest.raises(KeyboardInterrupt):
        measure(3, SMOKE, tmp_path, progress)
    monkeypatch.setattr(cases, "people_case", part("batch"))
    found = measure(3, SMOKE, tmp_path, progress)
    assert found == {"ocp": {"ocp": {"n": 1}}, "ioc": {"ioc": {"n": 1}}, "batch": {"n": 1}}
    assert asked == ["ocp", "ioc", "batch", "batch"]
    measure(4, SMOKE, tmp_path, progress)
    assert asked[4:] == ["ocp", "ioc", "batch"]  # of another seed nothing is known


def test_reaches_without_an_optimum_do_not_end_the_benchmark(monkeypatch):
    """One is drawn anew, another is not explained, a third is not found by the search."""
    scaling_of, explain, search = cases.scaling_of, cases.explain, cases.search
    calls = {"scaling_of": 0, "explain": 0, "search": 0}

    def failing(name, work, which):
        def tried(*given, **named):
            calls[name] += 1
            if calls[name] == which:
                error = NotConverged.__new__(NotConverged)
                HriError.__init__(error, "none was found")
                raise error
            return work(*given, **named)

        return tried

    monkeypatch.setattr(cases, "scaling_of", failing("scaling_of", scaling_of, 1))
    # Each reach is explained three times: both parts of it that are seen, and all of it.
    monkeypatch.setattr(cases, "explain", failing("explain", explain, 3))
    monkeypatch.setattr(cases, "search", failing("search", search, 1))
    told = []
    extent = Extent(inverse=3)
    rng = np.random.default_rng(0)
    found = cases.inverse_case(extent, rng, lambda done, _: told.append(done))
    assert told == [1, 2, 3]
    assert (found["n"], found["not_explained"], found["search_n"]) == (3, 1, 1)
    assert found["alpha_error_max"] == 1.0
    assert found["dtw_not_worse_share"] == 0.5
    assert found["cut"]["n"] == 3
    monkeypatch.setattr(cases, "explain", failing("explain", explain, calls["explain"] + 3))
    with pytest.raises(HriError, match="explained both ways"):
        cases.inverse_case(Extent(inverse=1), rng, lambda *_: None)


def test_of_laws_of_several_people_the_worst_counts():
    rng = np.random.default_rng(1)
    truth = rng.dirichlet(np.ones(4), 20)
    well = Compared(truth, truth + 1e-3, 0.1)
    badly = Compared(5.0 + truth, np.full_like(truth, 5.0) + truth.mean(axis=0), 0.3)
    found = _pooled([well, badly])
    assert found["r2_truth"] == pytest.approx(0.0, abs=1e-9)
    assert found["r2_of_each"][0] > 0.99
    assert found["r2_pooled"] > 0.99  # how they differ from each other would hide it
    assert (found["n"], found["people"]) == (40, 2)
    assert found["rms_cm"] == pytest.approx(0.2)


def test_a_new_process_that_fails_says_why(monkeypatch):
    monkeypatch.setattr(first_solve.sys, "executable", "false")
    with pytest.raises(HriError, match=r"exit code 1\); it said: nothing"):
        first_solve.first_solve()


def test_tasks_are_those_of_the_design():
    assert len(chosen_tasks(Extent().tasks)) == 81
    assert len(chosen_tasks(4)) == 4


def test_people_are_drawn_and_seen():
    first, second = draw_people(2, np.random.default_rng(4))
    again = draw_people(2, np.random.default_rng(4))[0]
    assert first.arm == again.arm != second.arm
    recorded = record(first, 1, 5, np.random.default_rng(0))
    assert len(recorded.tracks) == REPETITIONS
    assert recorded.alpha.sum() == pytest.approx(1.0)
    assert len(recorded.alpha) == len(CHAPTER_2)
    arm = measured_arm(first, [recorded])
    assert arm.upper_m == pytest.approx(first.arm.upper_m, rel=0.005)
    seen = see(recorded, arm)
    wanted = np.radians(design.STARTS_DEG[1]) + first.offsets[1]
    wanted = np.clip(wanted, ANATOMICAL.lower, ANATOMICAL.upper)
    assert np.abs(seen.problem.q_start - wanted).max() < np.radians(8.0)
    assert seen.misfit_m < 0.02
