"""Lists of recordings, files of costs, and movements of recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from two_arms import arm_track

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts, load_costs
from hri_prediction.ontology.costs import NUMBER
from hri_prediction.ontology.cutting import segments_of
from hri_prediction.ontology.movements import heading_of, learn_costs, movements_of, observed_range
from hri_prediction.ontology.recordings import read_sessions, write_sessions


def test_sessions_are_read_as_they_are_written(tmp_path: Path) -> None:
    entries = [
        {"bag": "one", "case": 7, "subject": "anna", "position": "frontal"},
        {
            "bag": "two",
            "case": "case_1",
            "subject": "ben",
            "bodies": ["ben", "carl"],
            "side": "left",
        },
    ]
    write_sessions(tmp_path / "sessions.yaml", entries)
    one, other = read_sessions(tmp_path)
    assert (one.bag, one.case, one.subject, one.side) == (tmp_path / "one", 7, "anna", "right")
    assert (other.case, other.bodies, other.side, other.position) == (
        1,
        ("ben", "carl"),
        "left",
        "",
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sessions: []", "lists no sessions"),
        ("nothing: 1", "lists no sessions"),
        ("sessions: [7]", "session 1"),
        ("sessions: [{bag: a, case: 1}]", "session 1: no subject"),
        ("sessions: [{bag: a, case: 21, subject: x}]", "session 1: case 21; expected 1 to 20"),
        (
            "sessions: [{bag: a, case: 1, subject: x, sight: y}]",
            "unknown 'sight'; expected bag, case",
        ),
        ("sessions: [{bag: a, case: 1, subject: x, bodies: [p]}]", "two different ids"),
        ("sessions: [{bag: a, case: 1, subject: x, bodies: [[], p]}]", "two different ids"),
        ("sessions: [{bag: a, case: 1, subject: x, side: up}]", "left or right"),
        (
            "sessions: [{bag: a, case: 1, subject: x}, {bag: ./a, case: 2, subject: y}]",
            "session 2: .*a is that of session 1 too; expected each recording of two people once",
        ),
        (
            "sessions: [{bag: a, case: 1, subject: x}, {bag: a, case: 1, subject: x, bodies: [p, q]}]",
            "session 2: .*a is that of session 1 too",
        ),
    ],
)
def test_what_is_wrong_with_a_list_is_said(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "sessions.yaml").write_text(text)
    with pytest.raises(DataError, match=said):
        read_sessions(tmp_path)


def test_a_list_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"sessions\.yaml"):
        read_sessions(tmp_path)


# ---------------------------------------------------------------------- costs
def costs() -> LearntCosts:
    one = CaseCosts(np.linspace(0.0, 1.0, NUMBER), np.full(NUMBER, 2.0), 40)
    return LearntCosts({"case_3": one}, 0.2, "somebody", ("case_3: few movements",))


def test_costs_on_disk(tmp_path: Path) -> None:
    costs().save(tmp_path / "c.json", origin={"commit": "x"})
    again = load_costs(tmp_path / "c.json")
    np.testing.assert_array_equal(again.cases["case_3"].weights, costs().cases["case_3"].weights)
    np.testing.assert_allclose(again.cases["case_3"].scaled, 2.0 * np.linspace(0.0, 1.0, NUMBER))
    assert (again.length, again.about, again.cases["case_3"].movements) == (0.2, "somebody", 40)
    assert again.warnings == costs().warnings


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("hri-interaction-costs-1", "other", "no file of learnt costs"),
        ('"length_m": 0.2', '"length_m": -1', "a positive length"),
        ("humerus-humerus", "humerus-knee", "other costs"),
        ("case_3", "case_33", "1 to 20"),
        ('"movements": 40', '"movements": null', "incomplete"),
        ("2.0,", "-2.0,", "none negative"),
        ('"case_3: few movements"', "3", "a list of texts"),
    ],
)
def test_wrong_costs_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "c.json"
    costs().save(path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises((DataError, ConfigError), match=said):
        load_costs(path)


# ---------------------------------------------------------------------- movements
def test_movements_have_the_joints_of_the_recording() -> None:
    one = arm_track([(0.5, 0.8, 0.2)], 2.0)
    other = arm_track([], 2.0, away=0.6, name="b")
    (movement,) = movements_of((one, other))
    (segment,) = segments_of((one, other))
    begin = segment.onset_ns * 1e-9
    points = movement.body.keypoints(movement.joints)
    times = begin + 0.02 * np.arange(len(points))
    tip = np.interp(times, one.time_s, one.keypoints[:, 3, 1])
    assert np.abs(points[:, 3, 1] - tip).max() < 0.003
    np.testing.assert_allclose(movement.partner[0], other.keypoints[0], atol=1e-9)
    assert heading_of(one.keypoints) == pytest.approx(0.2, abs=0.3)


def test_costs_are_learnt_from_movements() -> None:
    pairs = [
        (arm_track([(0.5, 0.8, 0.2)], 2.0, noise=0.0), arm_track([], 2.0, away=away, name="b"))
        for away in (0.45, 0.6)
    ]
    movements = [movement for pair in pairs for movement in movements_of(pair)]
    low, high = observed_range(movements)
    assert (low <= high).all()
    found = learn_costs(movements, np.random.default_rng(0), samples=20)
    assert found.weights.shape == (NUMBER,)
    assert (found.weights >= 0.0).all()
    # Something tells what they did from what they might have done.
    assert found.weights.any()
    assert np.isfinite(found.weights).all()
    with pytest.raises(DataError, match="one at least"):
        learn_costs([], np.random.default_rng(0))
