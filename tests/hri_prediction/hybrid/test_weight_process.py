"""Weights by posture: the simplex, Gaussian processes beside scikit-learn's, people beside all people."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.hybrid.fitting import data_of_reaches, fit_process
from hri_prediction.hybrid.weight_file import (
    data_of_values,
    data_to_values,
    load_process,
    save_process,
)
from hri_prediction.hybrid.weight_process import (
    LEAST_WEIGHT,
    PERSON_SD,
    PersonalProcess,
    WeightData,
    WeightProcess,
    to_alpha,
    to_logs,
)
from hri_prediction.motor_control.costs import CHAPTER_2, CHAPTER_3


@given(arrays(float, 4, elements=st.floats(0.02, 1.0)))
def test_weights_come_back_from_their_logarithms(raw):
    alpha = raw / raw.sum()
    logs, variance = to_logs(alpha, np.zeros((4, 4)), CHAPTER_2)
    if alpha.min() >= LEAST_WEIGHT:
        np.testing.assert_allclose(to_alpha(logs, CHAPTER_2), alpha, atol=1e-12)
    assert (variance > 0.0).all()


def test_what_one_weight_has_too_much_the_others_have_too_little(rng):
    """Errors of weights are not independent: their logarithms scatter as weights drawn with them do."""
    alpha = np.array([0.3, 0.4, 0.2, 0.1])
    along = np.array([[0.02, -0.03, 0.0, 0.01], [0.0, 0.005, -0.01, 0.005]])
    errors = along.T @ along
    drawn = alpha + rng.standard_normal((20000, 2)) @ along
    _, variance = to_logs(alpha, errors, CHAPTER_2)
    of_drawn = np.log(drawn) - np.log(drawn[:, 1:2])
    np.testing.assert_allclose(variance, np.delete(of_drawn, 1, axis=1).var(axis=0), rtol=0.1)
    _, of_many = to_logs(np.stack([alpha, alpha]), np.stack([errors, 4.0 * errors]), CHAPTER_2)
    np.testing.assert_allclose(of_many, [variance, 4.0 * variance])


@settings(max_examples=50)
@given(arrays(float, 4, elements=st.floats(-700.0, 700.0)))
def test_any_logarithms_are_on_the_simplex(logs):
    alpha = to_alpha(logs, CHAPTER_3)
    assert (alpha >= 0.0).all()
    assert alpha.sum() == pytest.approx(1.0)


def test_the_posterior_is_that_of_scikit_learn(people, rng):
    gp = pytest.importorskip("sklearn.gaussian_process")
    kernels = pytest.importorskip("sklearn.gaussian_process.kernels")
    asked = rng.uniform(-0.5, 1.5, (5, 6))
    for i in range(len(CHAPTER_2) - 1):
        kernel = kernels.ConstantKernel(people.amplitude[i]) * kernels.RBF(people.lengths[i])
        reference = gp.GaussianProcessRegressor(
            kernel, alpha=people.data.variance[:, i], optimizer=None
        ).fit(people.data.inputs, people.data.logs[:, i] - people.mean[i])
        mean, covariance = reference.predict(asked, return_cov=True)
        own_mean, own_covariance = people.posterior(i, asked)
        np.testing.assert_allclose(own_mean, mean + people.mean[i], atol=1e-9)
        np.testing.assert_allclose(own_covariance, covariance, atol=1e-8)


def test_a_person_is_like_all_people_until_seen(people):
    q_start, q_end = np.array([0.2, 0.1, 0.3]), np.array([0.1, 1.0, 0.4])
    guess = people.guess(q_start, q_end)
    again = PersonalProcess(people, WeightData.none(people.names)).guess(q_start, q_end)
    np.testing.assert_allclose(guess.alpha, again.alpha)
    mean, covariance = people.posterior(0, np.concatenate([q_start, q_end])[None])
    assert guess.logs[0] == pytest.approx(mean[0])
    # What people differ by is a part of what is open.
    assert guess.logs_sd[0] == pytest.approx(np.sqrt(covariance[0, 0] + PERSON_SD**2))


def test_what_was_seen_of_a_person_counts_most_where_it_was_seen(people):
    q_start, q_end = np.array([0.2, 0.1, 0.3]), np.array([0.1, 1.0, 0.4])
    alpha = np.array([0.1, 0.2, 0.6, 0.1])
    seen = WeightData.of(
        people.names, q_start[None], q_end[None], alpha[None], 0.002**2 * np.eye(4)[None]
    )
    person = PersonalProcess(people, WeightData.none(people.names)).learnt(seen)
    here, before = person.guess(q_start, q_end), people.guess(q_start, q_end)
    away = person.guess(q_start + 4.0, q_end + 4.0)
    np.testing.assert_allclose(here.alpha, alpha, atol=0.02)
    assert (here.logs_sd < 0.3 * before.logs_sd).all()
    unseen = people.guess(q_start + 4.0, q_end + 4.0)
    np.testing.assert_allclose(away.alpha, unseen.alpha, atol=1e-6)


def test_a_file_says_the_same(people, tmp_path):
    path = tmp_path / "weights.json"
    save_process(path, people, "a test")
    again = load_process(path)
    q = np.array([0.2, 0.1, 0.3]), np.array([0.1, 1.0, 0.4])
    np.testing.assert_allclose(again.guess(*q).alpha, people.guess(*q).alpha, atol=1e-3)


def test_the_one_that_ships_is_there():
    shipped = load_process()
    assert shipped.names == CHAPTER_3
    assert len(shipped.data) >= 100
    guess = shipped.guess(np.radians([-23.0, 16.0, 38.0]), np.radians([7.0, 64.0, 24.0]))
    assert guess.alpha.sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{}", "no process of weights"),
        ('{"format": "hri-weight-process-2"}', "lack or garble"),
        ("nonsense", "weights.json"),
        (
            '{"format": "hri-weight-process-2", "costs": ["speed"], "inputs": [], "logs": [], '
            '"variance": []}',
            "costs speed",
        ),
    ],
)
def test_files_of_something_else_are_refused(text, says, tmp_path):
    path = tmp_path / "weights.json"
    path.write_text(text)
    with pytest.raises(DataError, match=says):
        load_process(path)


def test_unusable_data_are_refused(people):
    with pytest.raises(ConfigError, match="joint_jerk"):
        WeightData.none(("hand_jerk", "energy"))
    with pytest.raises(DataError, match="shape"):
        WeightData(CHAPTER_2, np.zeros((2, 6)), np.zeros((2, 2)), np.ones((2, 3)))
    with pytest.raises(DataError, match="not positive"):
        WeightData(CHAPTER_2, np.zeros((1, 6)), np.zeros((1, 3)), np.zeros((1, 3)))
    with pytest.raises(DataError, match="finite"):
        WeightData(CHAPTER_2, np.full((1, 6), np.nan), np.zeros((1, 3)), np.ones((1, 3)))
    with pytest.raises(DataError, match="positive"):
        WeightProcess(people.data, people.mean, -people.amplitude, people.lengths)
    with pytest.raises(DataError, match="expected hand_jerk"):
        people.data.and_also(WeightData.none(CHAPTER_3))


def test_fitting_finds_what_posture_says():
    pytest.importorskip("sklearn")
    rng = np.random.default_rng(1)
    inputs = rng.uniform(-1.0, 1.0, (60, 6))
    logs = np.column_stack([1.5 * np.sin(2.0 * inputs[:, 0]), inputs[:, 4], 0.0 * inputs[:, 0]])
    noise = rng.normal(0.0, 0.1, logs.shape)
    data = WeightData(CHAPTER_2, inputs, logs + noise, np.full(logs.shape, 0.01))
    process = fit_process(data)
    asked = rng.uniform(-0.8, 0.8, (20, 6))
    found = np.array([process.guess(row[:3], row[3:]).logs for row in asked])
    truth = np.column_stack([1.5 * np.sin(2.0 * asked[:, 0]), asked[:, 4], 0.0 * asked[:, 0]])
    assert np.abs(found - truth).mean() < 0.1
    # The angle that matters has the shortest scale.
    assert process.lengths[0].argmin() == 0


def test_fitting_says_what_it_needs():
    with pytest.raises(DataError, match="10 or more"):
        fit_process(WeightData.none(CHAPTER_2))
    with pytest.raises(DataError, match="no reach was explained"):
        data_of_reaches(CHAPTER_2, [{"error": "no"}])
    with pytest.raises(DataError, match="lacks or garbles"):
        data_of_reaches(CHAPTER_2, [{"error": ""}])


def test_a_weight_at_the_bound_is_hardly_known():
    """Fisher's information knows nothing of weights that are 0: that they are small is all that is seen."""
    logs, variance = to_logs([1.0, 0.0, 0.0, 0.0], np.zeros((4, 4)), CHAPTER_2)
    assert (variance >= 1.0).all()
    assert np.abs(logs).max() == pytest.approx(np.log(1.0 / LEAST_WEIGHT))


def test_the_same_reach_counts_once(people):
    q_start, q_end = np.array([[0.2, 0.1, 0.3]]), np.array([[0.1, 1.0, 0.4]])
    errors = 0.05**2 * np.eye(4)[None]
    first = WeightData.of(people.names, q_start, q_end, [[0.1, 0.2, 0.6, 0.1]], errors)
    again = WeightData.of(people.names, q_start + 0.05, q_end, [[0.4, 0.2, 0.3, 0.1]], errors)
    other = WeightData.of(people.names, q_start + 0.5, q_end, [[0.4, 0.2, 0.3, 0.1]], errors)
    person = PersonalProcess(people, WeightData.none(people.names)).learnt(first).learnt(other)
    assert len(person.own) == 2
    person = person.learnt(again)
    assert len(person.own) == 2
    np.testing.assert_array_equal(person.own.logs[-1], again.logs[0])


def test_the_other_arms_reach_and_another_target_nearby_count_beside_it(people):
    """Angles of left arms are those of their mirror images: reaches to both sides look the same."""
    at = np.array([[0.2, 0.1, 0.3]]), np.array([[0.1, 1.0, 0.4]])
    data = WeightData.of(people.names, *at, [[0.1, 0.2, 0.6, 0.1]], 0.05**2 * np.eye(4)[None])
    person = PersonalProcess(people, WeightData.none(people.names))
    for name in ("right_a", "left_a", "right_b", "right_a"):
        person = person.learnt(data.of_reach(name))
    assert person.own.reaches == ("left_a", "right_b", "right_a")
    again = data_of_values(data_to_values(person.own))
    assert again.reaches == person.own.reaches
    # Of what was kept before reaches had names, anything near is the same.
    assert person.learnt(data).own.reaches == ("",)
    with pytest.raises(DataError, match="2 reaches"):
        WeightData(people.names, data.inputs, data.logs, data.variance, ("a", "b"))
