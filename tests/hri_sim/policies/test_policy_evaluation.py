"""Columns and tables of an evaluation, on cases whose answers are known."""

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.metrics.divergence import divergence, human_floor
from hri_planner.rnn.metrics.reaching import reaching
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import save_policy
from hri_planner.rnn.network import Network, new_network
from hri_planner.rnn.scales import Scales
from hri_prediction.errors import ConfigError, DataError
from hri_sim.policies import datasets, evaluation_command, judging, partners
from hri_sim.policies.datasets import SetSpec
from hri_sim.policies.evaluation import evaluate, finite, step_time_us
from hri_sim.policies.judging import data_for
from hri_sim.policies.likeness_table import likeness_table, mean_distance
from hri_sim.policies.partners import beside_partners
from hri_sim.policies.recordings import recording_hash


def coasting() -> PolicyModel:
    """A policy that never accelerates: hands go on as they came."""
    network = new_network("gru", (2,), np.random.default_rng(0))
    still = Network(network.layers, np.zeros((3, 2)), np.zeros(3))
    return PolicyModel(still, Scales(0.3, 5.0, 3.0), FeatureConfig())


def at_rest(away: float, backward: bool = False, steps: int = 30) -> Encounter:
    """A hand that rests so far from its goal, but for the person, who is there."""
    hand = np.zeros((steps, 3))
    hand[steps // 2 :, 0] = away
    return Encounter(hand, np.full((steps, 3), 3.0), (away, 0.0, 0.0), "s", backward, "s")


def test_columns_of_a_policy_that_rests() -> None:
    # At 1, 2, 10 mm from the goal it is there at once, the person at the start too; at 40 mm it is not.
    test = [at_rest(away) for away in (0.001, 0.002, 0.010, 0.040)]
    found = evaluate(coasting(), test, np.random.default_rng(0))
    assert found["reached_share"] == 0.75
    assert found["terminal_mm"]["reached_mean"] == pytest.approx(13.0 / 3.0)
    assert found["terminal_mm"]["all_mean"] == pytest.approx(53.0 / 4.0)
    assert found["terminal_mm"]["max"] == pytest.approx(40.0)
    assert found["reach_time_mse_s2"] == 0.0
    assert found["noise"]["terminal_mm"] == found["terminal_mm"]
    assert found["kl_backward"] is None
    assert found["forward"]["reached_share"] == 0.75
    assert "backward" not in found


def test_reach_times_are_compared_where_both_reach() -> None:
    path = np.zeros((3, 5, 3))
    path[:, :2, 0] = 0.1
    found = reaching(path, np.zeros((3, 3)), np.array((4.0, np.nan, 2.0)), 0.5)
    assert found.reach_time_mse == pytest.approx((1.0 + 0.0) / 2.0)
    assert found.reached_share == 1.0


def test_the_human_floor_is_near_zero_for_people_who_are_all_alike() -> None:
    rng = np.random.default_rng(1)
    phases = np.linspace(0.0, 1.0, 40)[:, None]

    def people(spread: float) -> list[np.ndarray]:
        ends = np.array((0.3, 0.1, 0.0)) + spread * rng.standard_normal((40, 3))
        return [phases * end for end in ends]

    floor = human_floor(people(0.02), np.random.default_rng(2))
    assert 0.0 < floor < 5.0
    paths = people(0.02)
    order = np.random.default_rng(2).permutation(40)
    first = [paths[row] for row in order[:20]]
    second = [paths[row] for row in order[20:]]
    one_split = human_floor(paths, np.random.default_rng(2), splits=1)
    assert one_split == pytest.approx(divergence(first, second))
    # Another kind of people is farther off than any half of the same.
    assert divergence(paths, people(0.2)) > 3.0 * floor


def test_numbers_that_json_does_not_know_are_none() -> None:
    found = finite({"a": float("nan"), "b": [1.0, float("inf")], "c": "x", "d": (np.float64(2.0),)})
    assert found == {"a": None, "b": [1.0, None], "c": "x", "d": [2.0]}
    json.dumps(found, allow_nan=False)


def test_a_step_takes_time() -> None:
    assert 0.0 < step_time_us(coasting(), 5) < 1e6


def slow_warping(first: np.ndarray, second: np.ndarray) -> float:
    """The cheapest of all ways, tried one by one."""
    apart = np.linalg.norm(first[:, None] - second[None], axis=2)

    def way(i: int, j: int) -> float:
        if i == j == 0:
            return apart[0, 0]
        before = [(i - 1, j), (i, j - 1), (i - 1, j - 1)]
        return apart[i, j] + min(way(a, b) for a, b in before if a >= 0 and b >= 0)

    return float(way(len(first) - 1, len(second) - 1))


def test_likeness_by_all_ways_of_warping() -> None:
    rng = np.random.default_rng(3)
    test = []
    for back in (False, True, False, True, False):
        hand = np.cumsum(0.1 * rng.standard_normal((6, 3)), axis=0)
        test.append(Encounter(hand, np.full((6, 3), 3.0), hand[-1], "s", back, "s"))
    found = likeness_table(coasting(), test, test, np.random.default_rng(0))
    human = [1e3 * one.hand for one in test]
    # The policy coasts through all of the simulation and reaches nothing.
    drifts = [1e3 * (one.hand[1] - one.hand[0]) for one in test]
    made = [
        one[0] + np.arange(201)[:, None] * drift for one, drift in zip(human, drifts, strict=True)
    ]
    assert set(found) == {"policy", "promp", "human"}
    assert set(found["policy"]) >= {"sample", "sample_sd", "paired", "coverage", "mean", "forward"}
    apart = [
        [slow_warping(one, other) if i != j else np.inf for j, other in enumerate(human)]
        for i, one in enumerate(human)
    ]
    assert found["human"]["sample"] == pytest.approx(np.min(apart, axis=1).mean())
    assert found["human"]["paired"] is None
    # A path that leads straight away is warped onto the end of the other but for its first positions.
    pairs = zip(made, human, strict=True)
    ends = [np.linalg.norm(one[-1] - other[-1]) for one, other in pairs]
    assert found["policy"]["paired"] > np.mean(ends)
    backward = [index for index, one in enumerate(test) if one.backward]
    assert found["human"]["backward"]["sample"] == pytest.approx(
        slow_warping(*(human[index] for index in backward))
    )


def test_mean_paths_are_compared_from_their_first_positions_on() -> None:
    line = np.linspace(0.0, 1.0, 11)[:, None] * np.array((0.3, 0.0, 0.0))
    there, back = line + 5.0, line[:6] * 2.0 + 1.0
    assert mean_distance([line], [there]) == pytest.approx(0.0, abs=1e-9)
    assert mean_distance([line, -line], [there, -line]) == pytest.approx(0.0, abs=1e-9)
    assert mean_distance([back], [line]) == pytest.approx(0.0, abs=1e-9)
    assert mean_distance([2.0 * line], [line]) > 100.0


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sets of a few encounters."""
    tiny = {
        "D1": SetSpec(setups=2, encounters=5, unseen=2, test_encounters=5),
        "D3-1": SetSpec(setups=2, encounters=30, shuffle=1),
    }
    monkeypatch.setattr(datasets, "SETS", tiny)
    monkeypatch.setattr(judging, "SETS", tiny)
    monkeypatch.setattr(partners, "SETUPS", 2)


def test_what_a_policy_is_judged_by(small: None) -> None:
    drawn = data_for("simulated", {"data": "D1", "data_seed": 0}, 3)
    again = data_for("D1", {}, 3)
    assert (drawn.name, drawn.simulated, len(drawn.test)) == ("D1", True, 10)
    np.testing.assert_array_equal(drawn.test[0].hand, again.test[0].hand)
    other = data_for("D1", {}, 4)
    assert other.test[0].hand[0, 0] != drawn.test[0].hand[0, 0]
    # Tested in the setups learnt from: what was kept of these, whatever the seed.
    kept = data_for("simulated", {"data": "D3-1", "data_seed": 7}, 3)
    same = data_for("simulated", {"data": "D3-1", "data_seed": 7}, 4)
    np.testing.assert_array_equal(kept.test[0].hand, same.test[0].hand)
    with pytest.raises(DataError, match="names the data ''"):
        data_for("simulated", {}, 0)
    with pytest.raises(DataError, match="nowhere"):
        data_for("nowhere.npz", {}, 0)


def test_recordings_that_a_policy_has_learnt_from_in_part(tmp_path: Path) -> None:
    path = tmp_path / "hands.npz"
    rng = np.random.default_rng(0)
    np.savez(
        path,
        pos=np.cumsum(0.01 * rng.standard_normal((120, 2, 3)), axis=0),
        start=np.arange(0, 120, 20),
        length=np.full(6, 20),
        pair=np.array(["a", "b", "c"] * 2),
        rate_hz=24.0,
    )
    strange = data_for(str(path), {"data": "D1"}, 0)
    assert (len(strange.learnt), len(strange.test), strange.apart) == (6, 6, False)
    header = {"data": "handover-without-b", "data_hash": recording_hash(path)}
    kept = data_for(str(path), header, 0)
    assert {one.pair for one in kept.test} == {"b"}
    assert {one.pair for one in kept.learnt} == {"a", "c"}
    assert kept.apart
    own = data_for(str(path), {"data": "hands.npz", "data_hash": recording_hash(path)}, 0)
    assert own.apart
    assert not {one.pair for one in own.test} & {one.pair for one in own.learnt}


def test_beside_partners_of_each_law(small: None) -> None:
    found = beside_partners(coasting(), 0, 2)
    assert list(found) == ["push", "sidestep", "none", "hesitate"]
    for one in found.values():
        assert one["encounters"] == 4
        assert one["reached_share"] == 0.0
        assert one["human"]["reached_share"] == 1.0
        assert one["human"]["reach_time_mse_s2"] == 0.0
        assert one["reach_time_mse_s2"] is None
        assert 0.0 <= one["near_share"] <= 1.0


def run(monkeypatch: pytest.MonkeyPatch, *options: str) -> None:
    monkeypatch.setattr("sys.argv", ["evaluate_rnn.py", *options])
    with contextlib.suppress(SystemExit):
        evaluation_command.main()


def test_results_of_the_command(
    small: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "mine.npz"
    save_policy(path, coasting(), {"data": "D1", "data_seed": 0})
    out = tmp_path / "out"
    run(monkeypatch, "--model", str(path), "--out", str(out), "--smoke", "--seed", "2")
    results = json.loads((out / "results.json").read_text())
    assert set(results) == {"origin", "data", "seed", "smoke", "configs", "dtw"}
    one = results["configs"]["mine"]
    columns = {"kl_forward", "kl_backward", "reach_time_mse_s2", "terminal_mm", "reached_share"}
    assert set(one) >= columns | {
        "cell",
        "units",
        "data",
        "kl_floor",
        "noise",
        "step_us",
        "partners",
    }
    assert set(one["noise"]) >= columns
    assert set(one["terminal_mm"]) == {"reached_mean", "all_mean", "max"}
    assert set(results["dtw"]) == {"policy", "promp", "human"}
    assert set(results["dtw"]["policy"]) >= {"sample", "paired", "coverage"}
    assert (out / one["picture"]).stat().st_size > 1000
    assert "| reached [%] | 0 / 0 |" in (out / "results.md").read_text()
    with pytest.raises(ConfigError, match="already holds"):
        run(monkeypatch, "--model", str(path), "--out", str(out), "--smoke")
    with pytest.raises(ConfigError, match="twice"):
        run(monkeypatch, "--model", str(path), "--model", str(path), "--out", str(out))
    with pytest.raises(DataError, match="missing"):
        run(monkeypatch, "--model", str(tmp_path / "missing.npz"), "--out", str(out))
    bad = tmp_path / "bad.npz"
    bad.write_bytes(path.read_bytes()[:300])
    with pytest.raises(DataError, match="bad"):
        run(monkeypatch, "--model", str(bad), "--out", str(out))


def test_policies_of_one_name_are_told_apart(tmp_path: Path) -> None:
    for folder in ("seed_0", "seed_1"):
        (tmp_path / folder).mkdir()
        save_policy(tmp_path / folder / "C7.npz", coasting(), {})
    found = evaluation_command.named([str(tmp_path / f / "C7.npz") for f in ("seed_0", "seed_1")])
    assert [item.name for item in found] == ["seed_0/C7", "seed_1/C7"]
