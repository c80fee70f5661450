"""Parameters of training."""

import pytest

from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"cell": "rnn"}, "cell = 'rnn'; expected one of lstm, gru, gru3t"),
        ({"units": (9, 0)}, "units"),
        ({"optimiser": "sgd"}, "optimiser = 'sgd'; expected one of bfgs, adam"),
        ({"imitation_rounds": -1}, "imitation_rounds = -1"),
        ({"closed_rate": 0.0}, r"closed_rate = 0\.0"),
        ({"noise": -0.001}, r"noise = -0\.001"),
        ({"patience": 0}, "patience = 0"),
        ({"first_horizon": 90, "last_horizon": 80}, "last_horizon = 80; expected at least 90"),
        ({"learning_rate": 0.1}, "learning_rate"),
        ({"batch": 2.5}, "batch"),
    ],
)
def test_what_cannot_be_is_named(values: dict, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        from_mapping(TrainingConfig, values)


def test_lists_of_a_file_are_units() -> None:
    assert from_mapping(TrainingConfig, {"units": [5, 7]}).units == (5, 7)
