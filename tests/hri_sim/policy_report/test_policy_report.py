"""The report from policies that learnt nothing: it is whole, says what is missed, and goes on."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import save_policy
from hri_planner.rnn.network import new_network
from hri_planner.rnn.scales import Scales
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.errors import ConfigError
from hri_prediction.results.origin import results_origin
from hri_sim.benchmark import workers
from hri_sim.policies import datasets, meetings, partners
from hri_sim.policies.datasets import SetSpec, handover_set, simulated_set
from hri_sim.policies.evaluation import situations
from hri_sim.policy_report import command, likeness, policies, watched
from hri_sim.policy_report.bars import Bar, bars, lines
from hri_sim.policy_report.encounters import _trimmed, summary
from hri_sim.policy_report.laboratory import kept_set
from hri_sim.policy_report.policies import Policy
from hri_sim.policy_report.report import SECTIONS, report
from hri_sim.policy_report.sets import replay_error
from hri_sim.reproduction import drawing


def a_model(policy: Policy) -> PolicyModel:
    config = policy.job.config
    network = new_network(config.cell, config.units, np.random.default_rng(1))
    return PolicyModel(network, Scales(0.3, 5.0, 0.5), FeatureConfig())


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few encounters, no recordings, nothing compiled."""
    spec = SetSpec(setups=2, encounters=6, unseen=2, test_encounters=8)
    monkeypatch.setattr(datasets, "SETS", {"D1": spec, "D2": spec})
    monkeypatch.setattr(partners, "SETUPS", 2)
    for module in (meetings, partners):
        monkeypatch.setattr(module, "SECONDS", 0.6)
    monkeypatch.setattr(partners, "LAWS", ("push", "none"))
    monkeypatch.setattr(drawing, "DPI", 30)
    monkeypatch.setattr(command, "dependency_hash", lambda module: module)
    monkeypatch.setattr(likeness, "SMOKE_COUNT", 6)
    monkeypatch.setattr(likeness, "SMOKE_FITTED", 3)
    monkeypatch.setattr(workers, "compile_kernels", lambda: None)
    monkeypatch.delenv("HRI_DATA_DIR", raising=False)
    kept_set.cache_clear()
    yield
    kept_set.cache_clear()


@pytest.fixture
def trained(small: None, tmp_path: Path) -> Path:
    """A folder with all policies of a smoke run."""
    runs = tmp_path / "runs"
    settings = TrainingConfig(), True
    for policy in (*policies.seed_policies(*settings), *policies.large_policies(*settings)):
        path = policy.file(runs)
        path.parent.mkdir(parents=True, exist_ok=True)
        header = {"data": policy.job.data, "data_seed": 0, "config": {"seed": 0}}
        save_policy(path, a_model(policy), header)
        config = {"cell": "x", "closed_rounds": 3}
        said = {
            "processor_seconds": 12.5,
            "rounds": [1, 2],
            "config": config,
            "origin": results_origin(),
        }
        path.with_suffix(".json").write_text(json.dumps(said))
    return runs


def run(monkeypatch: pytest.MonkeyPatch, *options: str) -> None:
    monkeypatch.setattr("sys.argv", ["reproduce_rnn.py", "--smoke", "--workers", "1", *options])
    with contextlib.suppress(SystemExit):
        command.main()


def test_the_report_is_written_wholly(
    trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    folders = ("--runs", str(trained), "--out", str(out))
    with pytest.raises(ConfigError, match="no results of sets"):
        run(monkeypatch, *folders, "--only", "times")
    run(monkeypatch, *folders)
    text = (out / "rnn.md").read_text()
    content = json.loads((out / "rnn.json").read_text())
    for section in SECTIONS:
        assert f"## {section.title}" in text
        assert section.name in content["sections"]
    assert text == report(content)
    assert "HRI_DATA_DIR is not set" in text
    assert "A smoke run" in text
    assert "nan" not in text
    assert "All trained with: closed_rounds 3." in text
    for name in ("nearest", "hands", "size", "states", "accelerations", "correlations"):
        assert (out / "rnn" / f"{name}.png").stat().st_size > 2000
        assert f"rnn/{name}.png" in text
    verdicts = {bar["what"]: bar["met"] for bar in content["bars"]}
    assert verdicts["label replay, all encounters"] is True
    assert verdicts["D1, gru3t 2x9: reached"] is None
    assert verdicts["training, up to 2x9, one core's time"] is True
    kept = content["sections"]["encounters"]["results"]["policies"]
    for kinds in kept.values():
        for kind in ("bounded", "arms"):
            assert kinds[kind]["encounters"] == 20
            assert kinds[kind]["with"]["violations"] == 0

    # Nothing is measured twice, but what is asked for.
    measured: list[str] = []
    monkeypatch.setattr(
        command,
        "SECTIONS",
        tuple(
            type(one)(one.name, one.title, _watched(one, measured), one.lines) for one in SECTIONS
        ),
    )
    run(monkeypatch, *folders)
    assert measured == []
    run(monkeypatch, *folders, "--only", "times")
    assert measured == ["times"]
    with pytest.raises(ConfigError, match="--only figures"):
        run(monkeypatch, *folders, "--only", "figures")


def _watched(section, measured: list[str]):
    def measure(laboratory):
        measured.append(section.name)
        return section.measure(laboratory)

    measure.__module__ = section.measure.__module__
    return measure


def test_policies_of_another_set_or_network_are_trained_again(small: None, tmp_path: Path) -> None:
    first = policies.seed_policies(TrainingConfig(), True)[0]
    assert not first.is_trained(tmp_path)
    first.file(tmp_path).parent.mkdir()
    for header, there in (
        ({"data": "D1", "data_seed": 0}, False),
        ({"data": "D2", "data_seed": 1}, False),
        ({"data": "D2", "data_seed": 0, "config": {"seed": 1}}, False),
        ({"data": "D2", "data_seed": 0, "config": {"seed": 0}}, True),
    ):
        save_policy(first.file(tmp_path), a_model(first), header)
        assert first.is_trained(tmp_path) is there


def test_what_the_report_is_about() -> None:
    all_seeds = policies.seed_policies(TrainingConfig(), False)
    assert len(all_seeds) == 24 + 2 * 6
    assert {p.name for p in all_seeds if p.data_seed == 1} == {
        f"seed_1/{name}" for name in policies.HEADLINE
    }
    assert all(policy.job.config.seed == policy.data_seed for policy in all_seeds)
    handovers = policies.handover_policies(TrainingConfig(), ["3"], False)
    assert {policy.job.data for policy in handovers} == {"handover-without-3"}
    assert [policy.name for policy in handovers] == ["handover_gru3t/pair_3", "handover_gru/pair_3"]
    assert [p.job.config.units for p in policies.large_policies(TrainingConfig(), False)] == [
        (n, n) for n in policies.LARGE_UNITS
    ]


def test_labels_replay_what_was_recorded(small: None) -> None:
    assert replay_error(simulated_set("D1", 0).test) < 1e-12


def test_recorded_handovers_of_other_pairs(small: None, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="HRI_DATA_DIR"):
        handover_set("a", 0)


def test_a_pair_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    path = tmp_path / datasets.FILE
    path.parent.mkdir()
    monkeypatch.setenv("HRI_DATA_DIR", str(tmp_path))
    np.savez(
        path,
        pos=np.cumsum(0.01 * rng.standard_normal((120, 2, 3)), axis=0),
        start=np.arange(0, 120, 20),
        length=np.full(6, 20),
        pair=np.array(["a", "b", "c"] * 2),
        rate_hz=24.0,
    )
    found = handover_set("b", 0)
    assert {one.pair for one in found.test} == {"b"}
    assert {one.pair for one in (*found.learnt, *found.validation)} == {"a", "c"}
    assert len(found.test) == 2


def test_encounters_are_counted_up_to_the_last_that_is_needed() -> None:
    batches = [
        {"partner_acceleration": np.array((1.0, 9.0, 2.0)), "nearest_with": np.array((1, 2, 3)),
         "drawn": np.array(4)},
        {"partner_acceleration": np.array((9.0, 3.0, 1.0)), "nearest_with": np.array((4, 5, 6)),
         "drawn": np.array(3)},
    ]  # fmt: skip
    found = _trimmed(batches, 3)
    assert found["nearest_with"].tolist() == [1, 2, 3, 4, 5]
    assert found["drawn"] == 7


def test_violations_are_counted() -> None:
    from hri_planner.policy.separation import SeparationConfig

    n = 4
    found = {
        "goal_free": np.array((True, True, False, True)),
        "filtered": np.array((0.0, 0.5, 0.0, 0.5)),
        "nearest_with": np.array((0.1, 0.1 - 1e-12, 0.3, 0.2)),
        "nearest_without": np.array((0.05, 0.2, 0.0999, 0.3)),
    }
    for name in ("with", "without"):
        found[f"reached_{name}"] = np.array((True, True, False, False))
        found[f"terminal_{name}"] = np.array((0.001, 0.003, 0.5, 0.05))
    one = summary(found, np.ones(n, dtype=bool), SeparationConfig())
    assert one["with"]["violations"] == 0
    assert one["without"]["violations"] == 2
    assert one["without"]["nearest_mm"] == pytest.approx(50.0)
    assert one["with"]["reached_share"] == 0.5
    assert one["with"]["reached_share_goal_free"] == pytest.approx(2.0 / 3.0)
    assert one["with"]["terminal_max_mm"] == pytest.approx(50.0)
    assert (one["with"]["strayed"], one["without"]["strayed"]) == (0, 0)
    assert one["acted_share"] == 0.5
    assert one["acted_time_share"] == 0.25
    nobody = summary(found, np.zeros(n, dtype=bool), SeparationConfig())
    assert nobody["with"]["reached_share"] is None


def configuration(share: float, terminal: float) -> dict:
    columns = {
        "reached_share": share,
        "reach_time_mse_s2": 0.02,
        "terminal_mm": {"reached_mean": terminal, "all_mean": terminal, "max": 5.0},
    }
    return {**columns, "noise": columns}


def test_bars_are_of_the_worst_seed() -> None:
    sections = {
        "configurations": {f"seed_{seed}/C7": configuration(1.0, 0.5 + seed) for seed in (0, 1, 2)}
        | {f"seed_{seed}/C8": configuration(1.0, 0.5) for seed in (0, 1)},
        "sets": {"D1": {"replay_error_m": 1e-15}, "handovers": {"skipped": "why"}},
        "handovers": {
            "cells": {"gru": {"1": configuration(1.0, 0.5), "2": configuration(0.75, 0.5)}}
        },
        "encounters": {
            "policies": {
                "x": {
                    "bounded": {"encounters": 10000, "with": {"violations": 1}},
                    "arms": {"encounters": 2000, "with": {"violations": 0}},
                }
            }
        },
        "times": {"x": {"units": [9, 9], "step_us": 60.0, "training_s": None}},
    }
    found = {bar.what: bar for bar in bars(sections)}
    assert found["D1, gru3t 2x9: reached"].met is True
    assert found["D1, gru3t 2x9: terminal, mean of all"].measured == 2.5
    assert found["D1, gru3t 2x9: terminal, mean of all"].met is False
    assert found["D1, gru3t 2x9: terminal with noise, mean of all"].met is True
    assert found["D1, gru 2x9: reached"].met is None
    assert found["handovers, pairs held out, gru: reached"].measured == 75.0
    assert found["handovers, pairs held out, gru3t: reached"].met is None
    assert found["violations with the filter, x, 10,000 encounters"].met is False
    assert found["violations with the filter, x, 2,000 encounters, whole arms"].met is True
    assert found["one step, up to 2x9"].met is True
    assert found["training, up to 2x9, one core's time"].met is None
    text = "\n".join(lines(list(found.values())))
    assert "**missed**" in text
    assert f"{sum(bar.met is True for bar in found.values())} met" in text


def test_a_value_on_the_bar_meets_it() -> None:
    assert Bar("x", 3.0, True, "mm", 3.0).met
    assert Bar("x", 100.0, False, "%", 100.0).met
    assert not Bar("x", 3.0, True, "mm", 3.0000001).met


def test_watched_motions_are_those_of_a_rollout(small: None) -> None:
    from hri_sim.policies.evaluation import STEPS, motions

    policy = policies.seed_policies(TrainingConfig(), True)[2]
    model = a_model(policy)
    found = situations(simulated_set("D1", 0).test)
    seen = watched.watch(model, found, 0.0, np.random.default_rng(0))
    exact = motions(model, found, 0.0, np.random.default_rng(0))
    np.testing.assert_allclose(seen.positions, exact[:, :STEPS], atol=1e-12)
    assert [one.shape[2] for one in seen.outputs] == [9, 9]
    assert model.network.kind == "lstm"
    assert all(np.abs(one).max() < 1.0 for one in seen.outputs)
