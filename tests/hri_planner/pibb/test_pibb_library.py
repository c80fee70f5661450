"""The library of policies, and what a comparison of them says."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.library import Entry, PolicyLibrary
from hri_prediction.errors import ConfigError, DataError, HriError

START = np.array([0.3, 0.1, 0.4])
GOALS = {"ahead": START + np.array([0.4, 0.0, 0.0]), "aside": START + np.array([0.3, 0.3, 0.0])}
LEARNT = {
    "experiment": "preliminary",
    "person": "somebody",
    "updates": 10,
    "trials": 256,
    "cost_first": 31.5,
    "cost_last": 22.0,
    "saved": "2026-01-02T03:04:05+00:00",
    "commit": "v1-2-gabc",
}


def straight(
    duration: float = 1.0, start: ArrayLike = START, goals: dict[str, Any] | None = None
) -> DmpPolicy:
    goals = GOALS if goals is None else goals
    weights = {name: np.zeros((3, 20)) for name in goals}
    return DmpPolicy(np.asarray(start), np.zeros(7), goals, weights, duration)


def bent(name: str, height: ArrayLike) -> DmpPolicy:
    """Straight but for a bump (3,) [m] in the middle of one way."""
    policy = straight()
    fitted, way = policy.response(), policy.path(name)
    u = np.minimum(fitted.times / policy.duration, 1.0)
    bump = 16.0 * (u * (1.0 - u)) ** 2
    weights = {
        **policy.weights,
        name: fitted.fit(way + bump[:, None] * np.asarray(height, dtype=float)),
    }
    return DmpPolicy(START, policy.posture, policy.goals, weights, policy.duration)


@pytest.fixture
def library(tmp_path: Path) -> PolicyLibrary:
    return PolicyLibrary(tmp_path / "policies")


# ------------------------------------------------------------------ what is there
def test_a_policy_that_was_added_is_there(library: PolicyLibrary) -> None:
    policy = bent("ahead", (0.0, 0.08, 0.0))
    file = library.add(policy, "ann", "preliminary", LEARNT)
    assert file == library.folder / "preliminary" / "ann.npz"
    assert library.file_of("preliminary", "ann") == file
    again, learnt = library.read("preliminary", "ann")
    assert learnt == {**LEARNT, "person": "ann"}
    for name in GOALS:
        assert again.path(name).tobytes() == policy.path(name).tobytes()
    assert library.load("preliminary", "ann").names == policy.names
    assert library.entries() == (
        Entry(
            "preliminary",
            "ann",
            file,
            ("ahead", "aside"),
            10,
            256,
            31.5,
            22.0,
            LEARNT["saved"],
            "v1-2-gabc",
        ),
    )
    assert [path.name for path in file.parent.iterdir()] == ["ann.npz"]


def test_all_are_listed_in_order_also_those_that_say_nothing(library: PolicyLibrary) -> None:
    for experiment, person in (("b", "eve"), ("a", "bob"), ("b", "ann"), ("a", "Zoë_1.2-x")):
        library.add(straight(), person, experiment, {})
    found = library.entries()
    assert [(one.experiment, one.person) for one in found] == [
        ("a", "Zoë_1.2-x"),
        ("a", "bob"),
        ("b", "ann"),
        ("b", "eve"),
    ]
    for one in found:
        assert (one.updates, one.trials, one.cost_first, one.commit) == (None, None, None, "")
        assert one.saved.startswith("20")


def test_headers_with_other_values_are_listed(library: PolicyLibrary) -> None:
    odd = {"updates": "ten", "trials": True, "cost_first": 10**400, "cost_last": None, "commit": 5}
    file = library.add(straight(), "ann", "a", {**odd, "saved": []})
    (found,) = library.entries()
    assert found == Entry("a", "ann", file, ("ahead", "aside"))


def test_where_nothing_is(library: PolicyLibrary) -> None:
    assert library.entries() == ()
    with pytest.raises(ConfigError, match=r"no policy of ann for a.*none at all"):
        library.load("a", "ann")
    with pytest.raises(ConfigError, match=r"no policy for a.*none at all"):
        library.compare("a")
    library.folder.write_text("")
    with pytest.raises(ConfigError, match="is a file"):
        library.entries()
    with pytest.raises(HriError, match="cannot write"):
        library.add(straight(), "ann", "a", {})


def test_errors_say_what_is_there(library: PolicyLibrary) -> None:
    for experiment, person in (("a", "ann"), ("a", "bob"), ("b", "eve")):
        library.add(straight(), person, experiment, {})
    with pytest.raises(ConfigError, match=r"no policy of eve for a; .*\(ann, bob\)"):
        library.load("a", "eve")
    with pytest.raises(ConfigError, match=r"no policy of eve for c; .*\(a: ann, bob; b: eve\)"):
        library.load("c", "eve")
    with pytest.raises(ConfigError, match=r"no policy for c; expected one of a, b"):
        library.compare("c")
    with pytest.raises(ConfigError, match=r"\(ann, bob\)"):
        library.compare("a", ["ann", "eve"])
    with pytest.raises(ConfigError, match="ann, ann; expected each once"):
        library.compare("a", ["ann", "ann"])


def test_nothing_is_replaced_unless_asked_for(library: PolicyLibrary) -> None:
    library.add(straight(), "ann", "a", {"seed": 1})
    with pytest.raises(ConfigError, match=r"ann\.npz is there already"):
        library.add(straight(2.0), "ann", "a", {"seed": 2})
    assert library.read("a", "ann")[1]["seed"] == 1
    library.add(straight(2.0), "ann", "a", {"seed": 2}, replace=True)
    policy, learnt = library.read("a", "ann")
    assert (policy.duration, learnt["seed"]) == (2.0, 2)


def test_a_policy_survives_when_its_replacement_fails(
    library: PolicyLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = library.add(straight(), "ann", "a", {"seed": 1})
    before = file.read_bytes()

    def full(path: Path, *rest: Any) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("hri_planner.pibb.library.save_dmp", full)
    with pytest.raises(HriError, match="No space left"):
        library.add(straight(2.0), "ann", "a", {}, replace=True)
    assert [path.read_bytes() for path in file.parent.iterdir()] == [before]


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../ann", "a/b", "/ann", ".ann", "-ann", "a b", "ann\n", "a\0b", "x" * 61],
)
def test_names_that_are_no_file_names(library: PolicyLibrary, name: str) -> None:
    for experiment, person in (("a", name), (name, "ann")):
        with pytest.raises(ConfigError, match="cannot be the name of a file"):
            library.add(straight(), person, experiment, {})
        with pytest.raises(ConfigError, match="cannot be the name of a file"):
            library.load(experiment, person)
    assert not library.folder.exists()


def test_damaged_policies_are_listed_as_such(library: PolicyLibrary) -> None:
    whole = library.add(straight(), "ann", "a", LEARNT).read_bytes()
    file = library.add(straight(), "bob", "a", LEARNT)
    rng = np.random.default_rng(4)
    refused = 0
    for turn in range(100):
        damaged = bytearray(whole)
        if turn % 4:
            damaged[int(rng.integers(len(whole)))] ^= int(rng.integers(1, 256))
        else:
            del damaged[int(rng.integers(len(whole))) :]
        file.write_bytes(damaged)
        ann, bob = library.entries()
        assert not ann.problem
        if not bob.problem:  # dates and the like, which mean nothing
            assert library.read("a", "bob")[1] == {**LEARNT, "experiment": "a", "person": "ann"}
            found = library.compare("a").pairs
            assert [pair.largest for pair in found] == [0.0, 0.0]
            continue
        refused += 1
        assert "bob" in bob.problem
        with pytest.raises(DataError, match="bob"):
            library.load("a", "bob")
        with pytest.raises(DataError, match="bob"):
            library.compare("a")
    assert refused > 70


def test_what_others_put_there(library: PolicyLibrary) -> None:
    file = library.add(straight(), "ann", "a", {})
    (file.parent / ".bob.part.npz").write_bytes(b"half")
    (file.parent / "notes.txt").write_text("")
    save_dmp(file.parent / "two words.npz", straight(), {})
    ann, other = library.entries()
    assert (ann.person, ann.problem) == ("ann", "")
    assert (other.person, other.problem) == ("two words", "a name that the library does not take")


# ------------------------------------------------------------------ comparison
def test_ways_beside_the_straight_line(library: PolicyLibrary) -> None:
    sides = {
        "left": (0.0, 0.08, 0.0),
        "right": (0.0, -0.08, 0.02),
        "up": (0.0, 0.02, 0.08),
        "down": (0.0, 0.0, -0.08),
        "none": (0.0, 0.0, 0.0),
    }
    for side, height in sides.items():
        library.add(bent("ahead", height), side, "a", {})
    found = library.compare("a", list(sides))
    assert found.persons == tuple(sides)
    assert found.goals == ("ahead", "aside")
    ways = {way.person: way for way in found.ways if way.goal == "ahead"}
    for side, height in sides.items():
        way = ways[side]
        assert way.side == side
        assert way.straight == pytest.approx(0.4, abs=1e-12)
        assert way.sideways == pytest.approx(np.linalg.norm(height), abs=5e-4)
        assert (way.left, way.up) == pytest.approx(height[1:], abs=5e-4)
        path = found.policies[side].path("ahead")
        assert way.length == pytest.approx(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    assert ways["none"].length == pytest.approx(0.4, abs=1e-3)
    assert ways["left"].length > 0.42
    # Of the other goal, none was bent.
    assert {way.side for way in found.ways if way.goal == "aside"} == {"none"}


def test_left_is_that_of_the_way(library: PolicyLibrary) -> None:
    # A way towards -y: left of it is +x; one upwards has its left at -y.
    goals = {"back": START - np.array([0.0, 0.4, 0.0]), "lift": START + np.array([0.0, 0.0, 0.4])}
    policy = straight(goals=goals)
    u = policy.response().times
    bump = 16.0 * (u * (1.0 - u)) ** 2
    weights = {
        "back": policy.response().fit(policy.path("back") + bump[:, None] * [0.05, 0.0, 0.0]),
        "lift": policy.response().fit(policy.path("lift") + bump[:, None] * [0.0, -0.05, 0.0]),
    }
    library.add(DmpPolicy(START, np.zeros(7), goals, weights, 1.0), "ann", "a", {})
    assert [way.side for way in library.compare("a").ways] == ["left", "left"]


def test_distances_of_ways_by_hand(library: PolicyLibrary) -> None:
    # Bob's are Ann's, moved by (3, 4, 0) cm; Eve's begin as Ann's and lead 10 cm higher.
    by = np.array([0.03, 0.04, 0.0])
    library.add(straight(), "ann", "a", {})
    moved = {name: place + by for name, place in GOALS.items()}
    library.add(straight(start=START + by, goals=moved), "bob", "a", {})
    higher = {name: place + np.array([0.0, 0.0, 0.1]) for name, place in GOALS.items()}
    library.add(straight(goals=higher), "eve", "a", {})
    found = library.compare("a")
    assert found.persons == ("ann", "bob", "eve")
    assert [(pair.goal, pair.first, pair.second) for pair in found.pairs] == [
        (goal, *two) for goal in GOALS for two in (("ann", "bob"), ("ann", "eve"), ("bob", "eve"))
    ]
    base = straight().response().base
    for pair in found.pairs:
        if (pair.first, pair.second) == ("ann", "bob"):
            assert pair.rms == pytest.approx(0.05, abs=1e-12)
            assert pair.largest == pytest.approx(0.05, abs=1e-12)
            assert pair.start_apart == pytest.approx(0.05, abs=1e-12)
            assert pair.goal_apart == pytest.approx(0.05, abs=1e-12)
        if (pair.first, pair.second) == ("ann", "eve"):
            assert pair.rms == pytest.approx(0.1 * np.sqrt(np.mean(base**2)), abs=1e-12)
            assert pair.largest == pytest.approx(0.1 * base.max(), abs=1e-12)
            assert (pair.start_apart, pair.goal_apart) == pytest.approx((0.0, 0.1), abs=1e-12)


def test_the_same_way_in_another_time_is_the_same_way(library: PolicyLibrary) -> None:
    library.add(straight(1.0), "ann", "a", {})
    library.add(straight(2.5), "bob", "a", {})
    library.add(straight(1.0011), "eve", "a", {})
    assert all(pair.largest < 1e-3 for pair in library.compare("a").pairs)
    ways = {way.person: way.length for way in library.compare("a").ways if way.goal == "ahead"}
    assert ways["bob"] == pytest.approx(ways["ann"], abs=1e-3)


def test_indistinctness_by_hand(library: PolicyLibrary) -> None:
    library.add(straight(), "ann", "a", {})
    library.add(bent("ahead", (0.0, -0.1, 0.0)), "bob", "a", {})
    ways = {(way.person, way.goal): way for way in library.compare("a").ways}
    # Straight ways from one place part as b(t) |g - g'|; every 20 ms of steps of 4 ms.
    b = straight().response().base[5::5]
    between = np.linalg.norm(GOALS["ahead"] - GOALS["aside"])
    wanted = 1.0 / (between * np.sum(b / np.arange(1, len(b) + 1)))
    assert ways["ann", "ahead"].indistinct == pytest.approx(wanted, rel=1e-9)
    assert ways["ann", "aside"].indistinct == pytest.approx(wanted, rel=1e-9)
    # Away from the other goal is more distinct.
    indistinct = ways["bob", "ahead"].indistinct
    assert indistinct is not None
    assert indistinct < wanted


def test_goals_that_not_all_know(library: PolicyLibrary) -> None:
    library.add(straight(), "ann", "a", {})
    library.add(straight(goals={"ahead": GOALS["ahead"]}), "bob", "a", {})
    twice = {"ahead": GOALS["ahead"], "again": GOALS["ahead"]}
    library.add(straight(goals=twice), "eve", "a", {})
    found = library.compare("a")
    assert found.goals == ("ahead", "aside", "again")
    assert {pair.goal for pair in found.pairs} == {"ahead"}
    assert len(found.pairs) == 3
    ways = {(way.person, way.goal): way for way in found.ways}
    assert sorted(ways) == [
        ("ann", "ahead"), ("ann", "aside"), ("bob", "ahead"), ("eve", "again"), ("eve", "ahead"),
    ]  # fmt: skip
    assert ways["ann", "ahead"].indistinct is not None
    assert ways["bob", "ahead"].indistinct is None
    assert ways["eve", "ahead"].indistinct is None


def test_one_alone_is_described(library: PolicyLibrary) -> None:
    library.add(straight(), "ann", "a", {})
    found = library.compare("a")
    assert (found.persons, found.pairs, len(found.ways)) == (("ann",), (), 2)


def test_json_holds_a_comparison(library: PolicyLibrary) -> None:
    library.add(straight(), "ann", "a", {})
    library.add(bent("ahead", (0.0, 0.1, 0.0)), "bob", "a", {})
    found = library.compare("a")
    again = json.loads(json.dumps(found.to_mapping(), allow_nan=False))
    assert sorted(again) == ["experiment", "goals", "pairs", "persons", "ways"]
    assert again["pairs"][0]["largest"] == found.pairs[0].largest
    assert again["ways"][0]["person"] == "ann"
