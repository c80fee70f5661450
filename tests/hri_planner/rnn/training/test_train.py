"""Training as a whole: stages, early ends, and going on after a stop."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from encounters import some_encounters

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.run import Trained, TrainingData, train
from hri_planner.rnn.training.state import TrainingState, load_state, save_state
from hri_prediction.errors import DataError

DATA = TrainingData(some_encounters(8), some_encounters(3, seed=1))
CONFIG = TrainingConfig(
    cell="gru", units=(3, 3), imitation_rounds=2, imitation_iterations=4, closed_rounds=3,
    closed_iterations=3, batch=4, first_horizon=15, last_horizon=25, hold=4,
)  # fmt: skip


class Stopped(Exception):
    """Training was broken off."""


def assert_same(one: PolicyModel, other: PolicyModel) -> None:
    assert one.scales == other.scales
    for name, values in one.network.to_arrays().items():
        np.testing.assert_array_equal(values, other.network.to_arrays()[name])


@pytest.fixture(scope="module")
def whole() -> Trained:
    return train(DATA, CONFIG)


@pytest.mark.parametrize("optimiser", ["bfgs", "adam"])
@pytest.mark.parametrize("after", [1, 2, 3, 4, 5])
def test_training_goes_on_where_it_was_broken_off(
    optimiser: str, after: int, tmp_path: Path
) -> None:
    config = replace(CONFIG, optimiser=optimiser)

    def stop(state: TrainingState) -> None:
        if len(state.history) == after:
            raise Stopped

    with pytest.raises(Stopped):
        train(DATA, config, checkpoint=tmp_path / "c.npz", progress=stop)
    rounds: list[int] = []
    resumed = train(
        DATA,
        config,
        checkpoint=tmp_path / "c.npz",
        progress=lambda state: rounds.append(len(state.history)),
    )
    assert rounds[0] >= after
    uninterrupted = train(DATA, config)
    assert_same(resumed.model, uninterrupted.model)
    assert resumed.history == uninterrupted.history


def test_what_it_was_is_told(whole: Trained) -> None:
    stages = [line["stage"] for line in whole.history]
    assert stages == ["imitation"] * 2 + ["closed_loop"] * 3
    assert [line["round"] for line in whole.history] == [0, 1, 0, 1, 2]
    assert all(np.isfinite((line["loss"], line["validation"])).all() for line in whole.history)


def test_the_same_again_and_another_with_another_seed(whole: Trained) -> None:
    assert_same(train(DATA, CONFIG).model, whole.model)
    other = train(DATA, replace(CONFIG, seed=1)).model
    assert np.abs(other.network.weight - whole.model.network.weight).max() > 1e-3


def test_a_stage_ends_when_it_does_not_get_better() -> None:
    config = replace(
        CONFIG, optimiser="adam", imitation_rate=10.0, imitation_rounds=9, patience=2,
        closed_rounds=0,
    )  # fmt: skip
    found = train(DATA, config)
    values = [line["validation"] for line in found.history]
    assert len(values) < 9
    best = int(np.argmin(values))
    assert len(values) == best + 3
    shorter = train(DATA, replace(config, imitation_rounds=best + 1))
    assert_same(found.model, shorter.model)  # the best is kept, not the last


def test_what_another_configuration_or_other_data_left_is_not_lost(tmp_path: Path) -> None:
    checkpoint = tmp_path / "c.npz"
    train(DATA, CONFIG, checkpoint=checkpoint)
    content = checkpoint.read_bytes()
    one = DATA.learnt[0]
    nudged = Encounter(one.hand, one.partner + 1e-9, one.goal)
    others = (
        (DATA, replace(CONFIG, seed=5)),
        (TrainingData([nudged, *DATA.learnt[1:]], DATA.validation), CONFIG),
        (TrainingData(DATA.learnt[:-1], [DATA.learnt[-1], *DATA.validation]), CONFIG),
    )
    for data, config in others:
        with pytest.raises(DataError, match=r"c\.npz: training of another .* write elsewhere"):
            train(data, config, checkpoint=checkpoint)
    assert checkpoint.read_bytes() == content


def test_training_that_diverges_says_so(tmp_path: Path) -> None:
    config = replace(CONFIG, closed_rate=1e300, clip=1e300)
    with (
        np.errstate(all="ignore"),
        pytest.raises(DataError, match=r"diverged: closed_loop round \d: .* lower closed_rate"),
    ):
        train(DATA, config, checkpoint=tmp_path / "c.npz")
    # What was good before it is still there.
    assert (tmp_path / "c.npz").is_file()


def test_time_before_a_stop_counts(tmp_path: Path) -> None:
    def stop(state: TrainingState) -> None:
        if len(state.history) == 3:
            raise Stopped

    with pytest.raises(Stopped):
        train(DATA, CONFIG, checkpoint=tmp_path / "c.npz", progress=stop)
    told: list[float] = []
    found = train(
        DATA, CONFIG, checkpoint=tmp_path / "c.npz",
        progress=lambda state: told.append(state.processor_seconds),
    )  # fmt: skip
    assert 0.0 < told[0] < told[-1] == found.processor_seconds


def test_a_finished_checkpoint_is_the_policy(whole: Trained, tmp_path: Path) -> None:
    train(DATA, CONFIG, checkpoint=tmp_path / "c.npz")
    rounds: list[TrainingState] = []
    again = train(DATA, CONFIG, checkpoint=tmp_path / "c.npz", progress=rounds.append)
    assert not rounds
    assert_same(again.model, whole.model)
    assert again.history == whole.history


def test_damaged_checkpoints_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "c.npz"
    state = TrainingState(
        "imitation", 1, {"a": np.ones(2)}, {"a": np.zeros(2)}, np.inf, 0, {}, {"state": 1}
    )
    save_state(path, state, "this")
    again = load_state(path, "this")
    assert again is not None
    assert again.best_value == np.inf
    np.testing.assert_array_equal(again.weights["a"], np.ones(2))
    with pytest.raises(DataError, match="of another configuration or other data"):
        load_state(path, "other")
    assert load_state(tmp_path / "none.npz", "this") is None
    content = path.read_bytes()
    for broken in (content[: len(content) // 2], b"", b"PK\x03\x04"):
        path.write_bytes(broken)
        with pytest.raises(DataError, match=r"c\.npz"):
            load_state(path, "this")


def test_there_must_be_something_to_learn_from() -> None:
    with pytest.raises(DataError, match="no encounters to learn from"):
        train(TrainingData([], DATA.validation), CONFIG)
    with pytest.raises(DataError, match="no encounters to end training by"):
        train(TrainingData(DATA.learnt, []), CONFIG)
    far = [Encounter(one.hand, one.hand + 3.0, one.goal) for one in DATA.learnt]
    with pytest.raises(DataError, match="push of the partner is zero"):
        train(TrainingData(far, DATA.validation), CONFIG)
