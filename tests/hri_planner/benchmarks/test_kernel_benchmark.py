"""The benchmark of the planner's kernel: its short run, its refusals, and what it compares."""

import json
import sys
import types

import numpy as np
import pytest

from hri_planner.benchmarks import kernel
from hri_planner.benchmarks import kernel_cases as cases
from hri_planner.benchmarks.plain_iteration import PlainOptimizer, smoothing_matrix
from hri_planner.benchmarks.references import available
from hri_planner.ptomp.smoothing import add_smooth_noise, smoothing_factors


def test_short_run(tmp_path, capsys):
    out = tmp_path / "out"
    assert kernel.main(["--out", str(out), "--smoke", "--seed", "3"]) == 0
    results = json.loads((out / "results.json").read_text())
    assert {"ours_f64", "ours_f32", "numpy", "pinocchio_loop"} <= set(results["config_ns"])
    assert set(results["iteration_us"]) == {"ours", "ours_f32", "numpy"}
    assert min(*results["config_ns"].values(), *results["iteration_us"].values()) > 0.0
    assert results["rollouts_per_s"] == pytest.approx(30e6 / results["iteration_us"]["ours"])
    assert results["forecast_ms"] > 0.0
    ratio = results["config_ns"]["numpy"] / results["config_ns"]["ours_f64"]
    assert results["ratios"]["config"]["numpy"] == pytest.approx(ratio)
    assert results["configurations"] == 1350
    for key in ("config_ns", "iteration_us"):
        assert results["fastest"][key].keys() == results[key].keys()
        assert all(results["fastest"][key][name] <= value for name, value in results[key].items())
    assert set(results["origin"]) == {"commit", "date", "machine"}
    doubles = [value for key, value in results["differences"].items() if "f32" not in key]
    assert 0.0 < max(doubles) <= 1e-9
    report = (out / "results.md").read_text()
    assert "benchmark_kernel.py --seed 3" in report
    assert "wanted ≥ 200000" in capsys.readouterr().out
    assert kernel.main(["--out", str(out), "--smoke"]) == 1
    error = capsys.readouterr().err
    assert "--overwrite" in error
    assert error.count("\n") == 1


def test_wrong_arguments(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert kernel.main(["--out", str(tmp_path / "file"), "--smoke"]) == 1
    assert "a folder" in capsys.readouterr().err
    assert kernel.main([]) == 2
    assert kernel.main(["--out", str(tmp_path / "new"), "--seed", "-1"]) == 2
    assert not (tmp_path / "new").exists()


def test_results_that_differ_are_an_error(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(kernel, "TOLERANCE", 0.0)
    assert kernel.main(["--out", str(tmp_path / "out"), "--smoke"]) == 3
    assert "results differ: clearance [m]" in capsys.readouterr().err


def test_without_references(monkeypatch):
    for name in ("pinocchio", "torch"):
        monkeypatch.setitem(sys.modules, name, None)
        assert not available(name)
    scene = cases.draw_scene(np.random.default_rng(0))
    found = cases.clearance_case(scene, cases.SMOKE, lambda: None)
    assert set(found.times) == {"ours_f64", "ours_f32", "numpy", "numpy_rows"}
    assert max(v for k, v in found.differences.items() if "f32" not in k) < 1e-12


def test_pytorch_is_asked_where_it_is_installed(monkeypatch):
    """With NumPy's functions under PyTorch's name, as far as they are the same."""
    torch = types.ModuleType("torch")
    for name in ("sin", "cos", "sqrt", "clip", "zeros_like"):
        setattr(torch, name, getattr(np, name))
    torch.as_tensor = np.asarray
    torch.set_num_threads = lambda number: None
    monkeypatch.setitem(sys.modules, "torch", torch)
    scene = cases.draw_scene(np.random.default_rng(0))
    found = cases.clearance_case(scene, cases.SMOKE, lambda: None)
    assert found.differences["clearance [m]: torch and pinocchio_loop"] < 1e-12


def test_noise_in_numpy_is_that_of_ours():
    factors, scale = smoothing_factors()
    normals = np.random.default_rng(1).standard_normal((3, 40))
    rows = np.zeros((3, 40))
    add_smooth_noise(factors, normals.ravel(), 40, scale[40], rows)
    np.testing.assert_allclose(normals @ smoothing_matrix(40), rows, rtol=1e-7)


def test_numpy_optimises_too():
    scene = cases.draw_scene(np.random.default_rng(2))
    rng = np.random.default_rng(3)
    plain = PlainOptimizer(scene.plain(), scene.config, rng, scene.trajectory)
    first = plain.cost
    costs = [plain.iterate(0.3) for _ in range(15)]
    assert np.all(np.diff([first, *costs]) <= 0.0)
    assert costs[-1] < 0.5 * first
    assert plain.costs.terms(plain.incumbent[None])[0].sum() == pytest.approx(costs[-1])
    np.testing.assert_array_equal(plain.incumbent[:, :3], scene.trajectory[:, :3])
    np.testing.assert_array_equal(plain.incumbent[:, -1], scene.trajectory[:, -1])
