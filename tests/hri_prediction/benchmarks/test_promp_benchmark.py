"""The benchmark of the ProMPs: its short run, its refusals, and its clock."""

import json
import time

import numpy as np
import pytest

from hri_prediction.benchmarks import promp_cases as cases
from hri_prediction.benchmarks import promp_reference as reference
from hri_prediction.benchmarks.promp import main
from hri_prediction.benchmarks.reaches import FOREARM, UPPER_ARM, draw_reach
from hri_prediction.benchmarks.timing import Contender, time_in_turn

KEYS = ("fit_ms", "condition_us", "mean_us", "bank_us")


def test_short_run(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["--out", str(out), "--smoke", "--seed", "3"]) == 0
    results = json.loads((out / "results.json").read_text())
    for key in KEYS:
        assert set(results[key]) == {"ours", "numpy", "movement_primitives"}
        assert min(results[key].values()) > 0.0
    assert 0.0 < results["max_difference"] <= 1e-8
    assert results["max_difference"] == max(results["differences"].values())
    assert set(results["origin"]) == {"commit", "date", "machine"}
    assert results["seed"] == 3
    report = (out / "results.md").read_text()
    assert "benchmark_promp.py --seed 3" in report
    assert "movement_primitives" in report
    assert f"{results['max_difference']:.1e}" in capsys.readouterr().out
    assert main(["--out", str(out), "--smoke"]) == 1
    error = capsys.readouterr().err
    assert "--overwrite" in error
    assert error.count("\n") == 1


def test_wrong_arguments(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file"), "--smoke"]) == 1
    assert "a folder" in capsys.readouterr().err
    assert main(["--out", str(tmp_path / "file" / "within")]) == 1  # at once, not after a minute
    assert "cannot write" in capsys.readouterr().err
    assert main([]) == 2
    assert main(["--out", str(tmp_path / "new"), "--seed", "-1"]) == 2
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("case", [cases.condition_case, cases.mean_case])
def test_without_movement_primitives(case):
    found = case(np.random.default_rng(0), cases.SMOKE, False, lambda: None)
    assert set(found.times) == {"ours", "numpy"}
    assert max(found.differences.values()) < 1e-10


def test_its_presence_is_asked_for(monkeypatch):
    assert reference.available()
    monkeypatch.setitem(__import__("sys").modules, "movement_primitives.promp", None)
    assert not reference.available()


def test_contenders_take_turns():
    seen: list[str] = []
    contenders = {
        "a": Contender(lambda i: seen.append(f"a{i}"), lambda: seen.append("a")),
        "b": Contender(lambda i: time.sleep(0.002), rounds=1),
    }
    taken = time_in_turn(contenders, rounds=3, steps=2)
    assert seen == ["a", "a0", "a1"] * 4  # one round to warm up
    assert taken["a"].size == 6
    assert taken["b"].size == 2
    assert taken["b"].min() >= 0.002


def test_drawn_reaches_are_arms():
    reach = draw_reach(np.random.default_rng(1), "far left", 0, 100.0)
    lengths = np.linalg.norm(np.diff(reach.keypoints, axis=1), axis=2)
    np.testing.assert_allclose(lengths[:, 0], UPPER_ARM, atol=0.005)
    np.testing.assert_allclose(lengths[:, 1], FOREARM, atol=0.005)
