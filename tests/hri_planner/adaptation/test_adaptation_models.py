"""Selections: what they learn, that they are fast, and that a saved one chooses as it did before."""

import time
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.adaptation import bayesian
from hri_planner.adaptation.best_fixed import BestFixed, best_fixed
from hri_planner.adaptation.features import FAR_M, FEATURES, Scaling, vector
from hri_planner.adaptation.gpr_selection import GprSelection, fit_gpr
from hri_planner.adaptation.grid import CELLS, Cell
from hri_planner.adaptation.model_file import (
    find_model,
    load_model,
    save_model,
    shipped_model,
    shipped_path,
)
from hri_planner.adaptation.success_selection import fit_success
from hri_planner.ptomp.situation import Situation
from hri_prediction import extras
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.promp.storage import write_npz

SITUATIONS = st.builds(
    Situation,
    uncertainty=st.floats(0.0, 0.2),
    error=st.floats(0.0, 0.5),
    distance=st.floats(-0.1, 3.0) | st.just(1e9) | st.just(np.inf),
    time_to_collision=st.floats(0.0, 3.0),
    collision_cost=st.floats(0.0, 1e4),
)


def motions(count=3000, seed=0):
    """Situations, cells (n, 2) and success: few time steps where it is far, many where it is near."""
    rng = np.random.default_rng(seed)
    features = rng.uniform(0.0, [0.05, 0.05, 1.0, 1.5, 5.0], size=(count, 5))
    cells = np.array([(c.num_timesteps, c.num_rollouts) for c in CELLS])
    cells = cells[rng.integers(len(cells), size=count)]
    wanted = np.where(features[:, 2] < 0.5, 60.0, 10.0)
    chance = 1.0 / (1.0 + np.exp(-4.0 + 0.15 * np.abs(cells[:, 0] - wanted)))
    return features, cells, (rng.random(count) < chance).astype(float), 10.0 + cells[:, 1]


@pytest.fixture(scope="module")
def success():
    return fit_success(*motions())


@pytest.fixture(scope="module")
def gpr():
    rng = np.random.default_rng(1)
    features = rng.uniform(0.0, [0.05, 0.05, 1.0, 1.5, 5.0], size=(80, 5))
    labels = np.stack((np.where(features[:, 2] < 0.5, 55.0, 15.0), np.full(80, 30.0)), axis=1)
    return fit_gpr(features, labels)


NEAR, FAR = Situation(0.02, 0.02, 0.1, 0.7, 10.0), Situation(0.02, 0.02, 0.9, 0.7, 10.0)


def test_success_is_learnt_and_the_cheapest_of_the_good_is_chosen(success):
    near, far = success.choose(NEAR), success.choose(FAR)
    assert near.num_timesteps >= 45
    assert far.num_timesteps <= 15
    assert near.num_rollouts == far.num_rollouts == 5  # success does not depend on it, cost does
    chance = success.success(NEAR)
    assert chance.shape == (132,)
    assert chance[CELLS.index(Cell(60, 30))] > 0.9 > 0.5 > chance[CELLS.index(Cell(10, 30))]


def test_all_cells_are_weighed_within_a_millisecond(success):
    seconds = []
    for _ in range(20):
        begin = time.perf_counter()
        success.choose(NEAR)
        seconds.append(time.perf_counter() - begin)
    assert min(seconds) < 1e-3


def test_labels_are_learnt_and_lowered(gpr):
    from dataclasses import replace

    predicted = gpr.predict(vector(NEAR))
    assert predicted[0] > 45.0
    assert predicted[1] == pytest.approx(30.0, abs=1e-6)
    assert gpr.choose(NEAR) == Cell(int(predicted[0]), int(predicted[1]))
    lower = replace(gpr, less=np.array([4.17, 5.48]))
    assert lower.choose(NEAR) == Cell(int(predicted[0] - 4.17), int(predicted[1] - 5.48))


def test_the_processes_predict_what_scikit_learn_predicts():
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    rng = np.random.default_rng(2)
    features = rng.uniform(size=(40, 5))
    labels = 30.0 + 10.0 * features[:, :2] + rng.normal(size=(40, 2))
    gpr = fit_gpr(features, labels)
    scaling = Scaling.of(features)
    for k in range(2):
        kernel = ConstantKernel(gpr.amplitudes[k]) * RBF(gpr.lengths[k]) + WhiteKernel(0.5)
        process = GaussianProcessRegressor(kernel, optimizer=None)
        process.fit(scaling(features), (labels[:, k] - gpr.offset[k]) / gpr.spread[k])
        cross = process.kernel_(scaling(features[:3]), scaling(features))
        expected = gpr.offset[k] + gpr.spread[k] * cross @ gpr.weights[k]
        assert [gpr.predict(row)[k] for row in features[:3]] == pytest.approx(expected)


def test_logistic_regression_finds_its_maximum_and_its_doubt():
    rng = np.random.default_rng(3)
    inputs = rng.normal(size=(500, 2))
    features = bayesian.quadratic(inputs)
    odds = 1.0 + 2.0 * inputs[:, 0]
    success = (rng.random(500) < bayesian.sigmoid(odds)).astype(float)
    model = bayesian.fit_logistic(features, success)
    assert model.weights[1] == pytest.approx(2.0, abs=0.6)
    few = bayesian.fit_logistic(features[:50], success[:50])
    there, far = features[:1], bayesian.quadratic(np.array([[6.0, 6.0]]))
    assert few.log_odds(there)[1] > model.log_odds(there)[1]
    assert model.log_odds(far)[1] > model.log_odds(there)[1]


def test_slope_of_the_posterior_is_zero_where_it_ends():
    rng = np.random.default_rng(4)
    features = bayesian.quadratic(rng.normal(size=(200, 2)))
    success = (rng.random(200) < 0.7).astype(float)
    prior = bayesian._prior(features.shape[1], 1.0)
    _, model = bayesian._maximise(features, success, 1.0)
    for k in range(features.shape[1]):
        step = 1e-5 * np.eye(features.shape[1])[k]
        values = [
            bayesian._log_posterior(features, success, prior, model.weights + sign * step)
            for sign in (1.0, -1.0)
        ]
        assert (values[0] - values[1]) / 2e-5 == pytest.approx(0.0, abs=1e-3)


def test_the_best_fixed_cell_is_not_the_luckiest():
    cells = np.repeat(np.arange(132), 10)
    block = {CELLS.index(Cell(ts, nt)) for ts in (40, 45, 50) for nt in (20, 25, 30)}
    success = np.array([1.0 if c in block or c == 0 else float(i % 2) for i, c in enumerate(cells)])
    found = best_fixed(cells, success, np.ones(len(cells)))
    assert found.choose(NEAR) == found.choose(FAR) == found.cell == Cell(45, 25)
    cost = np.array([CELLS[c].num_rollouts for c in cells], dtype=float)
    assert best_fixed(cells, np.ones(len(cells)), cost).cell.num_rollouts == 5
    with pytest.raises(DataError, match="none of 1320"):
        best_fixed(cells, np.zeros(len(cells)), cost)


@given(SITUATIONS)
def test_any_situation_is_a_finite_vector(situation):
    values = vector(situation)
    assert values.shape == (len(FEATURES),)
    assert np.isfinite(values).all()
    assert values[2] <= FAR_M


@pytest.fixture(scope="module")
def saved(success, gpr, tmp_path_factory):
    """Models, and as they are loaded again."""
    folder = tmp_path_factory.mktemp("models")
    pairs = []
    for number, model in enumerate((success, gpr, BestFixed(Cell(20, 15)))):
        save_model(folder / f"{number}.npz", model, {"budget": 64})
        pairs.append((model, load_model(folder / f"{number}.npz")))
    return pairs


@settings(max_examples=50)
@given(situation=SITUATIONS)
def test_a_saved_model_chooses_as_before_and_within_the_range(saved, situation):
    for before, after in saved:
        cell = after.choose(situation)
        assert cell == before.choose(situation)
        assert 10 <= cell.num_timesteps <= 60
        assert 5 <= cell.num_rollouts <= 60
        assert cell.on_grid or isinstance(after, GprSelection)


def test_unusable_files_are_named(tmp_path, gpr):
    path = tmp_path / "model.npz"
    with pytest.raises(DataError, match=r"model\.npz"):
        load_model(path)
    path.write_bytes(b"PK nothing")
    with pytest.raises(DataError, match=r"cannot read .*model\.npz"):
        load_model(path)
    header = {"format": "hri-adaptation-1", "kind": "gpr", "features": list(FEATURES)}

    def write(arrays, **changes):
        write_npz(path, arrays, {**header, **changes})

    good = gpr.to_arrays()
    for arrays, changes, text in (
        (good, {"format": "hri-promp-1"}, "hri-promp-1"),
        (good, {"kind": "oracle"}, "'oracle'.*fixed, gpr, success"),
        (good, {"features": ["error"]}, "for the inputs"),
        ({**good, "less": np.zeros(3)}, {}, r"less has shape \(3,\).*expected \(2,\)"),
        ({**good, "less": np.array([np.nan, 0.0])}, {}, "less holds NaN"),
        ({**good, "scale": np.zeros(5)}, {}, "scale is not positive"),
        ({k: v for k, v in good.items() if k != "less"}, {}, "expected .*'less'"),
        ({"cell": np.array([11.0, 5.0])}, {"kind": "fixed"}, "not on the grid"),
    ):
        write(arrays, **changes)
        with pytest.raises(DataError, match=text) as caught:
            load_model(path)
        assert "model.npz" in str(caught.value)


def test_files_hold_no_pickles(tmp_path, success):
    path = tmp_path / "model.npz"
    save_model(path, success, {})
    with zipfile.ZipFile(path) as archive:
        assert all(name.endswith(".npy") for name in archive.namelist())
    assert path.stat().st_size < 50_000


def test_models_that_ship_choose():
    for name in ("gpr_f8", "gpr_lower_f8", "success_f8", "fixed_f8"):
        assert find_model(name) is shipped_model(name)
        cell = find_model(str(shipped_path(name))).choose(NEAR)
        assert cell == shipped_model(name).choose(NEAR)
    with pytest.raises(ConfigError, match="success_f8"):
        shipped_model("success_f63")


def test_training_needs_numbers():
    with pytest.raises(DataError, match="two at least"):
        fit_gpr(np.zeros((1, 5)), np.zeros((1, 2)))
    with pytest.raises(DataError, match="NaN"):
        fit_gpr(np.full((3, 5), np.nan), np.zeros((3, 2)))
    with pytest.raises(DataError):
        bayesian.fit_logistic(np.zeros((0, 3)), np.zeros(0))


def test_what_training_lacks_is_said(monkeypatch):
    monkeypatch.setattr(extras.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"scikit-learn.*requirements/training\.txt"):
        fit_gpr(np.zeros((3, 5)), np.zeros((3, 2)))
