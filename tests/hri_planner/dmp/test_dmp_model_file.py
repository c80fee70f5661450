"""Policies of movement primitives on disk."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hri_planner.dmp.model_file import FORMAT, load_dmp, read_dmp, save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_prediction.errors import DataError
from hri_prediction.promp.storage import read_npz, write_npz


@pytest.fixture
def policy() -> DmpPolicy:
    rng = np.random.default_rng(0)
    goals = {"über": np.array((0.5, 0.2, 0.1)), "b": np.array((0.5, -0.2, 0.1))}
    weights = {name: rng.standard_normal((3, 20)) for name in goals}
    return DmpPolicy(np.array((0.4, 0.0, 0.3)), rng.uniform(-1.0, 1.0, 7), goals, weights, 2.25)


def test_a_saved_policy_is_the_same(policy: DmpPolicy, tmp_path: Path) -> None:
    save_dmp(tmp_path / "p.npz", policy, {"trials": 90, "of": "ann"})
    again, learnt = read_dmp(tmp_path / "p.npz")
    assert learnt == {"trials": 90, "of": "ann"}
    assert again.names == policy.names
    assert again.duration == policy.duration
    np.testing.assert_array_equal(again.start, policy.start)
    np.testing.assert_array_equal(again.posture, policy.posture)
    for name in policy.names:
        np.testing.assert_array_equal(again.goals[name], policy.goals[name])
        np.testing.assert_array_equal(again.weights[name], policy.weights[name])
        np.testing.assert_array_equal(again.path(name), policy.path(name))
    np.testing.assert_array_equal(load_dmp(tmp_path / "p.npz").start, policy.start)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"format": "hri-rnn-1"}, "format 'hri-rnn-1'"),
        ({"goals": ["a"]}, "2 goals; expected 1"),
        ({"goals": ["a", "a"]}, "goals"),
        ({"goals": ["start", "b"]}, "none of them named 'start'"),
        ({"goals": "ab"}, "goals 'ab'"),
        ({"goals": [1, 2]}, "goals"),
        ({"goals": None}, "goals None"),
        ({"duration": -1.0}, r"duration -1\.0"),
        ({"duration": "long"}, "long"),
        ({"duration": None}, r"p\.npz"),
    ],
)
def test_headers_that_do_not_fit_are_refused(
    policy: DmpPolicy, tmp_path: Path, change: dict[str, Any], match: str
) -> None:
    path = tmp_path / "p.npz"
    save_dmp(path, policy, {})
    arrays, header = read_npz(path, FORMAT)
    write_npz(path, arrays, {**header, **change})
    with pytest.raises(DataError, match=match) as found:
        load_dmp(path)
    assert str(path) in str(found.value)


@pytest.mark.parametrize("name", ["start", "posture", "goals", "weights"])
@pytest.mark.parametrize(
    "value", [None, 0.0, np.full((2, 3), np.nan), np.zeros((3, 3, 20)), np.array(["a", "b"])]
)
def test_arrays_that_do_not_fit_are_refused(
    policy: DmpPolicy, tmp_path: Path, name: str, value: Any
) -> None:
    path = tmp_path / "p.npz"
    save_dmp(path, policy, {})
    arrays, header = read_npz(path, FORMAT)
    del arrays[name]
    write_npz(path, arrays if value is None else {**arrays, name: value}, header)
    with pytest.raises(DataError, match=r"p\.npz"):
        load_dmp(path)


def test_damaged_files_are_refused(policy: DmpPolicy, tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    save_dmp(path, policy, {})
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(60):
        content = bytearray(whole)
        for place in rng.integers(0, len(whole), 20):
            content[place] ^= 0xFF
        path.write_bytes(bytes(content[: rng.integers(0, len(whole))]))
        with pytest.raises(DataError):
            load_dmp(path)
    for content in (b"", b"PK", b"not a policy", whole[: len(whole) // 2]):
        path.write_bytes(content)
        with pytest.raises(DataError, match=r"cannot read .*p\.npz"):
            load_dmp(path)
    with pytest.raises(DataError, match="nothing"):
        load_dmp(tmp_path / "nothing.npz")
    np.savez(path, weights=np.zeros(3))
    with pytest.raises(DataError, match=f"expected a .npz of format {FORMAT}"):
        load_dmp(path)
