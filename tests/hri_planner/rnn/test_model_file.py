"""Policies on disk."""

import json
from pathlib import Path

import numpy as np
import pytest

from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import find_policy, load_policy, read_policy, save_policy
from hri_planner.rnn.network import new_network
from hri_planner.rnn.scales import Scales
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.promp.storage import read_npz, write_npz


@pytest.fixture
def model() -> PolicyModel:
    network = new_network("gru3t", (5, 5), np.random.default_rng(0))
    return PolicyModel(network, Scales(0.6, 17.5, 5.0), FeatureConfig(influence=0.35))


def test_a_saved_policy_acts_as_before(model: PolicyModel, tmp_path: Path) -> None:
    save_policy(tmp_path / "m.npz", model, {"seed": 7})
    again, trained = read_policy(tmp_path / "m.npz")
    assert trained == {"seed": 7}
    hand, goal, partner = np.random.default_rng(1).uniform(-0.2, 0.2, (3, 4, 3))
    state = model.network.initial_state(4)
    for found, wanted in zip(
        again.accelerate(hand, goal, partner, state),
        model.accelerate(hand, goal, partner, state),
        strict=True,
    ):
        np.testing.assert_array_equal(found, wanted)
    assert again.features == model.features
    assert again.dt == model.dt


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"format": "other"}, "format 'other'"),
        ({"cell": "gpu"}, "cells of kind 'gpu'"),
        ({"cell": 3}, "cell = 3"),
        ({"units": [5, 6]}, "gru3t cells|inputs_1"),
        ({"units": "5"}, "units = '5'"),
        ({"inputs": ["goal_x"]}, "inputs"),
        ({"scales": {"goal": 0.0, "push": 1.0, "acceleration": 1.0}}, "scale of goal = 0.0"),
        ({"scales": {"goal": 1.0}}, "push"),
        ({"scales": None}, "scales = None"),
        ({"features": {"influence": -1.0}}, "influence = -1.0"),
        ({"dt": 0.0}, "time step 0.0"),
        ({"dt": "fast"}, "dt = 'fast'"),
    ],
)
def test_headers_that_do_not_fit_are_refused(
    model: PolicyModel, tmp_path: Path, change: dict, match: str
) -> None:
    path = tmp_path / "m.npz"
    save_policy(path, model, {})
    arrays, header = read_npz(path, "hri-rnn-1")
    write_npz(path, arrays, {**header, **change})
    with pytest.raises(DataError, match=match) as found:
        load_policy(path)
    assert str(path) in str(found.value)


def test_damaged_files_are_refused(model: PolicyModel, tmp_path: Path) -> None:
    path = tmp_path / "m.npz"
    save_policy(path, model, {})
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    unharmed = 0
    for _ in range(60):
        content = bytearray(whole)
        for place in rng.integers(0, len(whole), 20):
            content[place] ^= 0xFF
        path.write_bytes(bytes(content[: rng.integers(10, len(whole))]))
        try:
            load_policy(path)
        except DataError:
            continue
        unharmed += 1
    assert unharmed == 0
    with pytest.raises(DataError, match="nothing"):
        load_policy(tmp_path / "nothing.npz")


def test_a_name_that_is_not_known_is_answered_with_those_that_are() -> None:
    with pytest.raises(ConfigError, match=r"'rnn_x'.*a \.npz file"):
        find_policy("rnn_x")
    assert find_policy("somewhere/m.npz") == Path("somewhere/m.npz")
    assert json.dumps(str(find_policy("m.npz")))
