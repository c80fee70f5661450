"""Which file a policy's name stands for, and that policies of another kind are refused."""

from pathlib import Path

import pytest

from hri_planner.policy.model_file import (
    find_any,
    find_dmp,
    find_network,
    load_any,
    shipped_dmps,
)
from hri_planner.rnn.model_file import shipped_policies
from hri_prediction.errors import ConfigError, DataError

NETWORK, PRIMITIVES = shipped_policies()[0], shipped_dmps()[0]


def test_names_and_files_are_found() -> None:
    assert find_network(NETWORK) == find_any(NETWORK)
    assert find_dmp(PRIMITIVES) == find_any(PRIMITIVES)
    file = str(find_dmp(PRIMITIVES))
    assert find_dmp(file) == Path(file)
    assert load_any(file).names


def test_policies_of_another_kind_are_refused_saying_what_runs_them() -> None:
    for name in (PRIMITIVES, str(find_dmp(PRIMITIVES))):
        with pytest.raises(ConfigError, match=r"launch_dmp\.py") as caught:
            find_network(name)
        assert name in caught.value.problem
        assert NETWORK in caught.value.expected
    with pytest.raises(ConfigError, match=r"launch_rnn\.py") as caught:
        find_dmp(NETWORK)
    assert NETWORK not in caught.value.expected
    assert PRIMITIVES in caught.value.expected


def test_what_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"policy 'dmp_none'; expected .*ships: dmp_") as caught:
        find_dmp("dmp_none")
    assert not caught.value.hint
    with pytest.raises(DataError, match=r"none\.npz"):
        find_dmp(str(tmp_path / "none.npz"))
