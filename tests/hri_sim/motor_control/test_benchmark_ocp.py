"""The benchmark of optimal control: its short run, its refusals, and the people it is about."""

import json

import numpy as np
import pytest

from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ANATOMICAL
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_sim.motor_control.benchmark_cases import SMOKE, Extent, chosen_tasks
from hri_sim.motor_control.benchmark_command import bars, main
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
    "law": ["r2_truth"],
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
