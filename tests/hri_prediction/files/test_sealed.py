"""Checksums of JSON files, and the files that have one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.files.sealed import KEY, check_seal, checksum, sealed
from hri_prediction.hybrid import weight_file
from hri_prediction.hybrid.store import PERSON_FILE, PeopleStore
from hri_prediction.hybrid.weight_file import load_process, save_process
from hri_prediction.hybrid.weight_process import WeightData
from hri_prediction.ontology.cost_file import load_costs
from hri_prediction.ontology.shipped import SHIPPED_COSTS

SHIPPED_WEIGHTS = Path(weight_file.__file__).with_name(weight_file.SHIPPED)
NUMBER = re.compile(r"(?<=[\[ ])-?[0-9]+\.[0-9]+(?=[,\]\n])")
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


@given(st.dictionaries(st.text(), VALUES))
def test_what_is_read_again_fits(content: dict[str, Any]) -> None:
    whole = sealed(content)
    assert list(whole)[-1] == KEY
    for text in (json.dumps(whole), json.dumps(whole, indent=3, sort_keys=True)):
        check_seal(json.loads(text), "a.json")


def test_it_is_of_what_a_file_can_hold() -> None:
    assert checksum({"a": (1, 2.5), "b": {10: 0, 9: 1}}) == checksum(
        {"b": {"9": 1, "10": 0}, "a": [1, 2.5]}
    )
    assert checksum({"a": 1.0}) != checksum({"a": 1})
    assert checksum({"a": 0.1}) != checksum({"a": np.nextafter(0.1, 1.0)})


@pytest.mark.parametrize(
    "change", [{"a": 2}, {"more": None}, {KEY: "0" * 64}, {KEY: None}, {KEY: [1]}], ids=str
)
def test_what_does_not_fit_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(DataError, match=r"a\.json: its values .* remove sha256"):
        check_seal({**sealed({"a": 1}), **change}, "a.json")


def test_what_is_nested_too_deeply_is_refused() -> None:
    deep: list[Any] = []
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(DataError, match=KEY):
        check_seal({"a": deep, KEY: ""}, "a.json")


def test_files_without_one_are_read() -> None:
    check_seal({"a": 1}, "a.json")


@pytest.mark.parametrize(
    ("shipped", "load"),
    [(SHIPPED_COSTS, load_costs), (SHIPPED_WEIGHTS, load_process)],
    ids=["costs", "weights"],
)
def test_another_number_in_what_ships_is_noticed(
    shipped: Path, load: Callable[[Path], object], tmp_path: Path
) -> None:
    text = shipped.read_text()
    assert KEY in json.loads(text)
    path = tmp_path / shipped.name
    found = list(NUMBER.finditer(text))
    assert len(found) > 100
    for match in found[:: len(found) // 10]:
        other = repr(float(match.group()) * (1.0 + 1e-9) + 1e-12)
        path.write_text(text[: match.start()] + other + text[match.end() :])
        with pytest.raises(DataError, match=rf"{shipped.name}: .*{KEY}"):
            load(path)
        content = json.loads(path.read_text())
        del content[KEY]  # changed on purpose
        path.write_text(json.dumps(content))
        load(path)


def test_what_is_written_has_one(tmp_path: Path) -> None:
    process = load_process()
    path = tmp_path / "weights.json"
    save_process(path, process, "a test", {"off": 0.1})
    check_seal(json.loads(path.read_text()), path)
    assert KEY in json.loads(path.read_text())
    load_process(path)
    costs = tmp_path / "costs.json"
    load_costs(SHIPPED_COSTS).save(costs, origin={"commit": "x"})
    check_seal(json.loads(costs.read_text()), costs)
    assert KEY in json.loads(costs.read_text())


def test_a_person_whose_weights_are_altered_is_refused(tmp_path: Path) -> None:
    own = WeightData(("hand_jerk", "joint_jerk"), np.ones((1, 6)), np.ones((1, 1)), np.ones((1, 1)))
    store = PeopleStore(tmp_path)
    store.save("ann", [], own)
    assert store.load("ann")[1] is not None
    path = tmp_path / "ann" / PERSON_FILE
    content = json.loads(path.read_text())
    content["weights"]["logs"][0][0] = 1.5
    path.write_text(json.dumps(content))
    with pytest.raises(DataError, match=KEY):
        store.load("ann")
    assert KEY in store.people()[0].problem
