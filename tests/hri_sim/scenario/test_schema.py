"""Scenario files."""

import numpy as np
import pytest
import yaml

from hri_prediction.errors import ConfigError
from hri_sim.people.arm import SHOULDER_BREADTH
from hri_sim.scenario.examination import examine_scenario
from hri_sim.scenario.schema import (
    BACK,
    PersonSpec,
    Scenario,
    load_scenario,
    save_scenario,
    scenario_from_mapping,
)
from hri_sim.scenario.shipped import load_shipped, shipped_names


def values(**changes):
    base = {
        "name": "test",
        "robot_start": [0.0] * 7,
        "targets": {"a": [0.4, 0.3, 0.2], "b": [0.45, 0.1, 0.12]},
        "persons": [{"id": "ann"}, {"id": "bob", "side": "left"}],
        "reaches": [
            {"robot_target": "a", "person_target": "b"},
            {"robot_target": "a", "person_target": "b", "person": "bob"},
            {"robot_target": "a"},
        ],
    }
    base.update(changes)
    return base


def test_defaults_and_lookups():
    scenario = scenario_from_mapping(values())
    assert scenario.person_of(0).id == "ann"
    assert scenario.person_of(1).side == "left"
    assert scenario.person_from(1) == scenario.persons[1].home
    assert scenario.person_from(2) == scenario.targets["b"]
    assert scenario.candidates(0) == ("b",)
    assert scenario.candidates(2) == ()
    assert scenario.table.top < 0.0


def test_round_trip(tmp_path):
    scenario = scenario_from_mapping(values())
    save_scenario(tmp_path / "scenario.yaml", scenario)
    assert load_scenario(tmp_path / "scenario.yaml") == scenario
    with pytest.raises(ConfigError, match="cannot write"):
        save_scenario(tmp_path / "no" / "scenario.yaml", scenario)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"colour": "red"}, "unknown field colour"),
        ({"targets": None}, "targets = None"),
        ({"robot_start": [0.0] * 6}, "robot_start.6 is missing"),
        ({"robot_start": [0.0] * 6 + ["x"]}, r"robot_start.6 = 'x'.*number"),
        ({"seed": -1}, "seed = -1.*greater than or equal to 0"),
        ({"targets": {"a": [0.1, 0.2, float("nan")]}}, r"targets.a.2 = nan.*finite"),
        ({"targets": {"1a": [0.1, 0.2, 0.3]}}, "targets.1a"),
        ({"targets": {BACK: [0.1, 0.2, 0.3]}}, r"targets.\(back\)"),
        ({"reaches": []}, "reaches"),
        ({"reaches": [{"robot_target": "c"}]}, "'c' is not in: a, b"),
        ({"reaches": [{"robot_target": "a", "person_target": "c"}]}, "'c' is not in: a, b"),
        ({"reaches": [{"robot_target": "a", "person_target": "a", "person": "eve"}]}, "eve"),
        ({"reaches": [{"robot_target": "a", "duration": 0}]}, r"reaches.0.duration = 0"),
        (
            {"reaches": [{"robot_target": "a", "person_target": "b", "person_candidates": ["a"]}]},
            "lack the person_target",
        ),
        ({"persons": [{"id": "ann"}, {"id": "ann"}]}, "share an id"),
        ({"persons": [{"side": "both"}]}, r"persons.0.side = 'both'.*'right' or 'left'"),
        ({"persons": [{"home": [0.0, 0.0, 0.0]}]}, "persons.0: home .* out of reach"),
        ({"persons": []}, "no persons"),
        ({"targets": {"a": [0.4, 0.3, 0.2], "b": [0.1, 0.1, 0.1]}}, "'b' is out of reach of ann"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, changes, match):
    path = tmp_path / "scenario.yaml"
    path.write_text(yaml.safe_dump(values(**changes)))
    with pytest.raises(ConfigError, match=match) as caught:
        load_scenario(path)
    assert "scenario.yaml" in str(caught.value)
    assert len(str(caught.value).splitlines()) <= 1 + len(caught.value.faults)


def test_all_that_is_wrong_is_named_at_once(tmp_path):
    path = tmp_path / "scenario.yaml"
    wrong = values(
        seed=-1,
        persons=[{"id": "ann", "sidee": "left"}, {"side": "both"}],
        table={"colour": "red"},
        light="on",
    )
    path.write_text(yaml.safe_dump(wrong))
    with pytest.raises(ConfigError) as caught:
        load_scenario(path)
    head, *lines = str(caught.value).split("\n")
    assert head == f"{path}: 5 faults"
    assert sorted(line.split(";")[0] for line in lines) == [
        "  persons.1.side = 'both'",
        "  seed = -1",
        "  unknown field light",
        "  unknown field persons.0.sidee",
        "  unknown field table.colour",
    ]
    text = str(caught.value)
    assert "table.colour; expected one of center, size" in text
    assert "persons.0.sidee; expected one of id, side, shoulder" in text
    assert "light; expected one of name, seed, robot_start, table" in text
    with pytest.raises(ConfigError, match=r"reaches.0.duration = 0") as caught:
        scenario_from_mapping(values(reaches=[{"robot_target": "a", "duration": 0}]))
    assert len(caught.value.faults) == 1


def test_parts_that_do_not_fit_each_other_are_all_named():
    wrong = values(
        reaches=[
            {"robot_target": "c", "person_target": "d"},
            {"robot_target": "a", "person_target": "b", "person": "eve"},
        ]
    )
    with pytest.raises(ConfigError) as caught:
        scenario_from_mapping(wrong)
    assert len(caught.value.faults) == 3
    for word in ("robot_target 'c'", "target 'd'", "person 'eve'"):
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["", "- 1\n", "a: [", "\x00"])
def test_files_that_are_no_mapping(tmp_path, text):
    path = tmp_path / "scenario.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"scenario\.yaml"):
        load_scenario(path)
    with pytest.raises(ConfigError, match="cannot read"):
        load_scenario(tmp_path / "absent.yaml")


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_scenarios_are_fair_tests(name):
    scenario = load_shipped(name)
    assert isinstance(scenario, Scenario)
    assert scenario.name == name
    reports = examine_scenario(scenario)
    assert len(reports) == 3
    assert all(report.accepted and report.staying_clearance > 0.02 for report in reports)
    assert scenario.persons[0].side == ("left" if name.endswith("left") else "right")


def test_unknown_shipped_scenario_lists_those_there_are():
    with pytest.raises(ConfigError, match="table_reach, table_reach_left"):
        load_shipped("none")


@pytest.mark.parametrize(("side", "sign"), [("right", -1.0), ("left", 1.0)])
def test_the_other_arm_is_the_mirror_image(side, sign):
    person = PersonSpec(side=side, shoulder=(0.75, 0.1, 0.4), home=(0.5, 0.25, 0.1), both_arms=True)
    other = person.other
    assert other is not None
    assert {person.side, other.side} == {"left", "right"}
    assert other.shoulder == pytest.approx((0.75, 0.1 + sign * SHOULDER_BREADTH, 0.4))
    middle = 0.5 * (person.shoulder[1] + other.shoulder[1])
    assert other.home == pytest.approx((0.5, 2.0 * middle - 0.25, 0.1))
    posture = person.arm.posture(person.home, person.swivel)
    mirrored = posture * [1.0, -1.0, 1.0] + [0.0, 2.0 * middle, 0.0]
    np.testing.assert_allclose(other.arm.posture(other.home, other.swivel), mirrored, atol=1e-12)
    assert list(person.arms) == ["person1", f"person1/{other.side}"]
    assert not other.both_arms
    assert person.reaches_with(side)
    assert not person.reaches_with(other.side)


def test_people_have_one_arm_unless_a_scenario_says_otherwise(tmp_path):
    scenario = scenario_from_mapping(values())
    assert list(scenario.arms) == ["ann", "bob"]
    assert scenario.persons[0].other is None
    assert scenario.persons[0].reaches_with("left")
    save_scenario(tmp_path / "one.yaml", scenario)
    assert "both_arms" not in (tmp_path / "one.yaml").read_text()
    people = [{"id": "ann", "both_arms": True}, {"id": "bob", "side": "left"}]
    both = scenario_from_mapping(values(persons=people))
    assert list(both.arms) == ["ann", "ann/left", "bob"]
    save_scenario(tmp_path / "both.yaml", both)
    assert load_scenario(tmp_path / "both.yaml") == both
