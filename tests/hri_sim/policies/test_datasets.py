"""The simulated sets."""

import numpy as np
import pytest

from hri_planner.rnn.encounters import TURNS_DEG
from hri_prediction.errors import ConfigError
from hri_sim.policies import datasets
from hri_sim.policies.datasets import SETS, SetSpec, simulated_set

SMALL = {
    "D1": SetSpec(setups=2, encounters=6, unseen=2, test_encounters=3),
    "D2": SetSpec(setups=1, encounters=6, unseen=2, test_encounters=3),
    "D3-1": SetSpec(setups=2, encounters=20, shuffle=1),
    "D3-2": SetSpec(setups=2, encounters=20, shuffle=2),
    "D3-3": SetSpec(setups=2, encounters=20, shuffle=3),
}


@pytest.fixture(autouse=True)
def _small_sets(monkeypatch: pytest.MonkeyPatch) -> None:
    assert list(SMALL) == list(SETS)
    monkeypatch.setattr(datasets, "SETS", SMALL)


def test_tests_are_in_setups_from_which_nothing_is_learnt() -> None:
    data = simulated_set("D1", 0)
    seen = {one.setup for one in (*data.learnt, *data.validation)}
    assert len(seen) == 2
    assert seen.isdisjoint(one.setup for one in data.test)
    assert len(data.test) == 6
    assert len(data.validation) == 1
    assert len(data.learnt) == len(TURNS_DEG) * 11


def test_what_is_learnt_from_is_turned_in_all_directions() -> None:
    data = simulated_set("D2", 0)
    count = len(data.learnt) // 4
    first = data.learnt[0]
    for index, angle in enumerate(TURNS_DEG):
        turned = data.learnt[index * count]
        np.testing.assert_allclose(turned.hand, first.turned(angle).hand, atol=1e-12)
    cosine = (data.learnt[count].hand[-1] - data.learnt[count].hand[0])[:2] @ (
        first.hand[-1] - first.hand[0]
    )[:2]
    assert cosine == pytest.approx(0.0, abs=1e-12)


def test_shuffles_are_of_the_same_encounters() -> None:
    sets = [simulated_set(f"D3-{shuffle}", 0) for shuffle in (1, 2, 3)]
    tests = [{one.hand.tobytes() for one in data.test} for data in sets]
    alls = [
        {one.hand.tobytes() for one in (*d.learnt[: len(d.learnt) // 4], *d.validation, *d.test)}
        for d in sets
    ]
    assert [len(test) for test in tests] == [2, 2, 2]
    assert alls[0] == alls[1] == alls[2]
    assert tests[0] != tests[1] != tests[2] != tests[0]
    for data, test in zip(sets, tests, strict=True):
        assert test.isdisjoint(one.hand.tobytes() for one in data.learnt)


def test_sets_follow_from_name_and_seed() -> None:
    one, again, other = (simulated_set("D2", seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(one.learnt[3].hand, again.learnt[3].hand)
    assert one.learnt[3].hand.tobytes() != other.learnt[3].hand.tobytes()
    assert simulated_set("D1", 0).test[0].hand.tobytes() != one.test[0].hand.tobytes()
    with pytest.raises(ConfigError, match="data set 'D4'; expected one of D1, D2, D3-1"):
        simulated_set("D4", 0)
