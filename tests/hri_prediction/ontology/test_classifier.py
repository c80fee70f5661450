"""The quadratic machine as quadratic forms: against scikit-learn, and on disk."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.svm import SVC

from hri_prediction.errors import DataError
from hri_prediction.ontology.classifier import (
    COUNT,
    InteractionClassifier,
    coupled,
    negative_log,
    train,
)
from hri_prediction.ontology.features import EXCHANGED
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ontology.verdict import grouped, verdict_on


def blobs(
    seed: int, classes: tuple[int, ...] = (1, 4, 7), each: int = 40
) -> tuple[np.ndarray, np.ndarray]:
    """Segments of classes that overlap a little, the same in either order of the agents."""
    rng = np.random.default_rng(seed)
    middles = {k: np.random.default_rng(k).uniform(0.1, 0.9, COUNT) for k in classes}
    x = np.concatenate(
        [m + m[EXCHANGED] + 0.45 * rng.normal(size=(each, COUNT)) for m in middles.values()]
    )
    return x, np.repeat(classes, each)


@pytest.fixture(scope="module")
def model() -> InteractionClassifier:
    return train(*blobs(0), rng=np.random.default_rng(0), about="blobs")


@pytest.mark.parametrize("classes", [(1, 4, 7, 9), (2, 3)])
def test_decisions_are_those_of_scikit_learn(classes: tuple[int, ...]) -> None:
    x, y = blobs(1, classes)
    found = train(x, y, cost=2.0, slope=1.0, rng=np.random.default_rng(0))
    both, labels = np.concatenate((x, x[:, EXCHANGED])), np.concatenate((y, y))
    z = (both - both.mean(axis=0)) / both.std(axis=0)
    machine = SVC(
        C=2.0, kernel="poly", degree=2, gamma=1.0 / COUNT, coef0=1.0, decision_function_shape="ovo"
    ).fit(z, labels)
    probes = np.random.default_rng(2).normal(1.0, 0.5, (30, COUNT))
    wanted = machine.decision_function((probes - both.mean(axis=0)) / both.std(axis=0))
    if len(classes) == 2:
        wanted = -wanted[:, None]
    np.testing.assert_allclose(found.decisions(probes), wanted, atol=1e-8)


def test_most_are_recognised_and_probabilities_mean_something(model: InteractionClassifier) -> None:
    x, y = blobs(5, each=200)
    given = model.probabilities(x)
    np.testing.assert_allclose(given.sum(axis=1), 1.0)
    right = model.classify(x) == y
    assert right.mean() > 0.8
    # As sure as it is right, on the whole.
    assert given.max(axis=1).mean() == pytest.approx(right.mean(), abs=0.08)
    assert negative_log(model, x, y).mean() < np.log(3.0)


def test_the_order_of_the_agents_does_not_matter(model: InteractionClassifier) -> None:
    x, _ = blobs(6)
    np.testing.assert_allclose(model.probabilities(x), model.probabilities(x[:, EXCHANGED]))


@given(st.integers(0, 10**6), st.integers(2, 6))
@settings(max_examples=50)
def test_pairs_that_agree_are_coupled_exactly(seed: int, count: int) -> None:
    p = np.random.default_rng(seed).dirichlet(np.ones(count), 4)
    pairs = [p[:, i] / (p[:, i] + p[:, j]) for i, j in itertools.combinations(range(count), 2)]
    np.testing.assert_allclose(coupled(np.stack(pairs, axis=1)), p, atol=1e-5)


def test_coupling_finds_the_least_of_what_it_is_to_minimise() -> None:
    rng = np.random.default_rng(4)
    pairwise = rng.uniform(0.05, 0.95, (1, 6))
    r = np.zeros((4, 4))
    for value, (i, j) in zip(pairwise[0], itertools.combinations(range(4), 2), strict=True):
        r[i, j], r[j, i] = value, 1.0 - value

    def badness(p: np.ndarray) -> float:
        return float(
            sum((r[j, i] * p[i] - r[i, j] * p[j]) ** 2 for i in range(4) for j in range(4))
        )

    (found,) = coupled(pairwise)
    for _ in range(200):
        other = np.abs(found + 0.02 * rng.normal(size=4))
        assert badness(found) <= badness(other / other.sum()) + 1e-12


def test_on_disk(model: InteractionClassifier, tmp_path: Path) -> None:
    path = tmp_path / "model.npz"
    model.save(path)
    again = InteractionClassifier.load(path)
    x, _ = blobs(7)
    np.testing.assert_array_equal(again.classify(x), model.classify(x))
    np.testing.assert_allclose(again.probabilities(x), model.probabilities(x), atol=1e-4)
    assert again.about == "blobs"
    assert path.stat().st_size < 20_000


def test_the_same_generator_gives_the_same_machine() -> None:
    one, other = (train(*blobs(3), rng=np.random.default_rng(1)) for _ in range(2))
    assert one.slope == other.slope
    np.testing.assert_array_equal(one.forms, other.forms)


@pytest.mark.parametrize("name", ["classes", "forms", "mean", "root"])
def test_incomplete_files_are_refused(
    model: InteractionClassifier, tmp_path: Path, name: str
) -> None:
    from hri_prediction.promp.storage import read_npz, write_npz

    path = tmp_path / "model.npz"
    model.save(path)
    arrays, header = read_npz(path, "hri-interaction-classifier-2")
    del arrays[name]
    write_npz(path, arrays, header)
    with pytest.raises(DataError, match="is incomplete"):
        InteractionClassifier.load(path)
    path.write_bytes(b"junk")
    with pytest.raises(DataError, match=r"hri-interaction-classifier-2"):
        InteractionClassifier.load(path)


def test_wrong_arrays_are_refused(model: InteractionClassifier) -> None:
    for change, match in (
        ({"forms": model.forms[:, 1:]}, "forms has shape"),
        ({"slope": 0.0}, "slope"),
        ({"farthest": np.inf}, "farthest"),
        ({"root": -model.root}, "diagonal"),
        ({"classes": model.classes[::-1]}, "increasing"),
    ):
        with pytest.raises(DataError, match=match):
            replace(model, **change)  # type: ignore[arg-type]
    with pytest.raises(DataError, match=r"features have shape"):
        model.decisions(np.zeros((2, 24)))


def test_too_little_to_train_on_is_said() -> None:
    x, y = blobs(0)
    with pytest.raises(DataError, match="40 of class 1; expected two classes or more"):
        train(x[:40], y[:40], rng=np.random.default_rng(0))
    with pytest.raises(DataError, match="finite"):
        train(np.full_like(x, np.nan), y, rng=np.random.default_rng(0))


def test_a_distance_that_is_always_the_same_is_named() -> None:
    features, labels = blobs((1, 2))
    features[:, 0] = 0.3
    with pytest.raises(DataError, match="the distance humerus-humerus is the same"):
        train(features, labels, rng=np.random.default_rng(0))


def test_each_distance_as_usual_and_all_together_as_never() -> None:
    """Two distances that always go together, in a movement in which they do not."""
    rng = np.random.default_rng(6)
    labels = np.repeat([1, 4], 200)
    features = rng.normal(0.5, 0.1, (400, 25))
    features[:, 24] = features[:, 0] + rng.normal(
        0.0, 0.01, 400
    )  # both orders: neither is exchanged
    model = train(features, labels, rng=rng)
    assert model.strangeness(features).max() == pytest.approx(1.0, abs=1e-6)
    assert model.unlike(features[0]) == ""
    strange = np.full(25, 0.5)
    strange[[0, 24]] = 0.72, 0.28  # what many have, in one of them
    assert (np.abs(strange - model.mean) < 2.5 * model.scale).all()
    assert (np.abs(features - model.mean) > 2.5 * model.scale).any(axis=1).mean() > 0.1
    said = model.unlike(strange)
    assert said.startswith("unlike what was learnt: ")
    assert "humerus-humerus" in said or "hand tip-hand tip" in said


def test_probabilities_of_groups_are_sums() -> None:
    given = np.array([[0.1, 0.2, 0.3, 0.4], [0.7, 0.1, 0.1, 0.1]])
    numbers, sums = grouped(np.array([1, 10, 12, 13]), given)
    assert numbers.tolist() == [1, 4, 6]
    np.testing.assert_allclose(sums, [[0.1, 0.5, 0.4], [0.7, 0.2, 0.1]])


def test_groups_are_as_likely_as_their_cases_together(model: InteractionClassifier) -> None:
    x, _ = blobs(8)
    verdict = verdict_on(model, x[0])  # cases 1, 4 and 7: groups 1, 7 and 5
    assert verdict.number in (1, 4, 7)
    assert verdict.group == {1: 1, 4: 7, 7: 5}[verdict.number]
    assert verdict.group_probability == pytest.approx(verdict.probability)
    assert verdict.probabilities.sum() == pytest.approx(1.0)


def test_recordings_are_left_out_whole_for_the_slope() -> None:
    """Where segments of a recording are all alike, it is less sure of those of another one."""
    rng = np.random.default_rng(2)
    x, y, groups = [], [], []
    for session in range(12):
        case = (1, 4)[session % 2]
        middle = np.full(COUNT, 0.3 if case == 1 else 0.5) + 0.4 * rng.normal(size=COUNT)
        for _ in range(15):
            x.append(middle + 0.02 * rng.normal(size=COUNT))
            y.append(case)
            groups.append(session)
    slopes = [
        train(np.array(x), y, groups=given, rng=np.random.default_rng(0)).slope
        for given in (None, groups)
    ]
    assert slopes[1] < 0.5 * slopes[0]


def test_what_is_unlike_anything_learnt_is_said() -> None:
    model = InteractionClassifier.load(SHIPPED)
    assert model.unlike(model.mean) == ""
    far = model.mean.copy()
    far[24] += 4.1 * model.scale[24]
    said = model.unlike(far)
    assert said.startswith("unlike what was learnt: ")
    assert "mostly by hand tip-hand tip, " in said
    assert verdict_on(model, far).unlike == said
    z = 4.1 * np.eye(25)[24]
    wanted = np.sqrt(z @ np.linalg.inv(model.root @ model.root.T) @ z) / model.farthest
    assert model.strangeness(far[None])[0] == pytest.approx(wanted)
    apart = model.mean + 6.0 * model.scale  # all of both arms, as of people a metre apart
    assert model.unlike(apart)
