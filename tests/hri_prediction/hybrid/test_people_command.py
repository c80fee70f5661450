"""People on the command line: listed, shown, renamed, forgotten; weights fitted to results."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from reaching import reach_of

from hri_prediction.hybrid import fit_command, people_command
from hri_prediction.hybrid.store import PERSON_FILE, PeopleStore
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.weight_process import WeightData

NEAR = TaskKey("right", "rest", "near")


@pytest.fixture
def folder(person, rest, rng, tmp_path):
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=np.zeros(3)))
    PeopleStore(tmp_path).save("ann", [person.tasks[NEAR]], person.weights.own)
    return tmp_path


def run(*words):
    return people_command.main([str(word) for word in words])


def test_what_explains_a_person_is_shown(person, folder, capsys):
    own = WeightData.of(
        person.weights.names,
        np.array([[0.2, 0.1, 0.3]]),
        np.array([[0.1, 1.0, 0.4]]),
        [[0.1, 0.2, 0.6, 0.1]],
        0.05**2 * np.eye(4)[None],
    )
    store = PeopleStore(folder)
    store.save("ann", [person.tasks[NEAR]], own.of_reach(NEAR.file))
    assert run("show", "ann", "--folder", folder) == 0
    words = capsys.readouterr().out
    assert "mean paths explained: 1" in words
    assert "duration [s]" in words
    assert all(name in words for name in ("hand_jerk", "energy", "right_near_from_rest"))
    assert "0.60" in words


def test_people_are_listed_shown_moved_and_deleted(folder, capsys):
    assert run("list", "--folder", folder) == 0
    assert "ann" in capsys.readouterr().out
    assert run("show", "ann", "--folder", folder) == 0
    assert "near_from_rest" in capsys.readouterr().out
    assert run("move", "ann", "anna", "--folder", folder) == 0
    assert run("delete", "anna", "--yes", "--folder", folder) == 0
    assert run("list", "--folder", folder) == 0
    assert "nobody" in capsys.readouterr().out


@pytest.mark.parametrize("words", [("-h",), ("list", "-h"), ("move", "--help")])
def test_help_is_given_by_both_names(words, capsys):
    assert run(*words) == 0
    assert "Usage" in capsys.readouterr().out


def test_what_is_wrong_is_a_line(folder, capsys):
    assert run("delete", "bob", "--yes", "--folder", folder) == 1
    assert "one that is there (ann)" in capsys.readouterr().err
    assert run("move", "ann", "a/b", "--folder", folder) == 1
    assert "letters, digits" in capsys.readouterr().err
    (folder / "ann" / PERSON_FILE).write_text("{")
    assert run("list", "--folder", folder) == 0
    assert "damaged" in capsys.readouterr().out
    assert run("show", "ann", "--folder", folder) == 1
    assert PERSON_FILE in capsys.readouterr().err
    assert run("delete", "ann", "--yes", "--folder", folder) == 0


COSTS = ["hand_jerk", "joint_jerk", "energy"]


def twelve_reaches() -> list[dict[str, Any]]:
    """As fit_ioc.py writes them."""
    rng = np.random.default_rng(0)
    return [
        {
            "error": "",
            "name": f"reach {number}",
            "q_start_deg": rng.uniform(-20.0, 40.0, 3).tolist(),
            "q_end_deg": rng.uniform(0.0, 80.0, 3).tolist(),
            "alpha": rng.dirichlet([4.0, 4.0, 4.0]).tolist(),
            "covariance": (0.05**2 * np.eye(3)).ravel().tolist(),
            "factors": [2.0, 1.0, 3.0],
            "rest_factors": [1.0, 1.0, 2.0],
        }
        for number in range(12)
    ]


def test_weights_are_fitted_to_results(tmp_path, capsys):
    pytest.importorskip("sklearn")
    costs, rows = COSTS, twelve_reaches()
    results, out = tmp_path / "results.json", tmp_path / "new" / "weights.json"
    results.write_text(json.dumps({"costs": costs, "reaches": rows}))
    assert fit_command.main([str(results), "--out", str(out), "--about", "twelve of Ann"]) == 0
    said = capsys.readouterr()
    assert "12 reaches" in said.out
    assert "is not known: 3 people are needed" in said.out
    assert "these reaches were cut" in said.err
    assert load_process(out).names == tuple(costs)
    assert json.loads(out.read_text())["origin"] == "twelve of Ann"
    # Weights that a predictor may name are not replaced unasked.
    assert fit_command.main([str(results), "--out", str(out)]) == 1
    assert "add --overwrite" in capsys.readouterr().err
    assert fit_command.main([str(results), "--out", str(out.parent)]) == 1
    assert "is a folder" in capsys.readouterr().err
    assert json.loads(out.read_text())["origin"] == "twelve of Ann"
    assert fit_command.main([str(results), "--out", str(out), "--overwrite"]) == 0
    assert json.loads(out.read_text())["origin"] == "12 single reaches, results.json"


def test_whole_people_are_left_out(tmp_path, capsys):
    pytest.importorskip("sklearn")
    rows = [
        {**row, "person": f"{who} {side}"}
        for who in ("ann", "bob", "cleo")
        for side, row in zip(("left", "right") * 6, twelve_reaches(), strict=True)
    ]
    results, out = tmp_path / "results.json", tmp_path / "weights.json"
    results.write_text(json.dumps({"costs": COSTS, "whole": True, "reaches": rows}))
    assert fit_command.main([str(results), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "people who are left out (3 in turn)" in said.out
    assert "cut" not in said.err
    assert json.loads(out.read_text())["left_out"]["people"] == 3.0


def test_tasks_that_one_person_alone_did(tmp_path, capsys):
    """Twelve, of which the others did nine: without that one too few are left to judge by, not to fit."""
    pytest.importorskip("sklearn")
    tasks = [
        {
            "task": row["name"],
            "q_start_deg": row["q_start_deg"],
            "q_end_deg": row["q_end_deg"],
            "logs": np.log(np.array(row["alpha"]) / row["alpha"][1])[[0, 2]].tolist(),
            "log_sd": [0.1, 0.1],
        }
        for row in twelve_reaches()
    ]
    laws = [
        {"person": f"{who} right", "costs": COSTS, "tasks": tasks[:count]}
        for who, count in (("ann", 12), ("bob", 9), ("cleo", 9))
    ]
    results, out = tmp_path / "results.json", tmp_path / "weights.json"
    content = {"costs": COSTS, "whole": True, "reaches": [], "laws": laws}
    results.write_text(json.dumps(content))
    assert fit_command.main([str(results), "--out", str(out)]) == 0
    assert "here are 3 people and 12 reaches, 9 without one of them" in capsys.readouterr().out
    assert load_process(out).names == tuple(COSTS)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("alpha", [3.0, -1.0, 0.2], "reach 'reach 3': alpha"),
        ("alpha", [float("nan"), 0.5, 0.5], "reach 'reach 3': alpha"),
        ("alpha", [0.5, 0.5], "lacks or garbles"),
        ("covariance", [-0.1] * 9, "reach 'reach 3': covariance"),
        ("covariance", [0.1] * 3, "lacks or garbles"),
        ("covariance", [0.1, 0.2, 0.0] + [0.0] * 6, "reach 'reach 3': covariance"),
        ("rest_factors", [0.0, 1.0, 1.0], "reach 'reach 3': rest_factors"),
    ],
)
def test_weights_that_are_none_are_refused(key, value, says, tmp_path, capsys):
    rows = twelve_reaches()
    rows[3][key] = value
    (tmp_path / "results.json").write_text(json.dumps({"costs": COSTS, "reaches": rows}))
    out = tmp_path / "w.json"
    assert fit_command.main([str(tmp_path / "results.json"), "--out", str(out)]) == 1
    assert says in capsys.readouterr().err
    assert not out.exists()


def test_single_reaches_do_not_stand_in_for_laws_that_were_not_found(tmp_path, capsys):
    content = {"costs": COSTS, "whole": True, "law": True, "reaches": twelve_reaches(), "laws": []}
    (tmp_path / "results.json").write_text(json.dumps(content))
    out = tmp_path / "w.json"
    assert fit_command.main([str(tmp_path / "results.json"), "--out", str(out)]) == 1
    assert "no law was found of anybody" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(("key", "value"), [("convention", "pitch_yaw"), ("scaling", "range")])
def test_weights_of_another_arm_are_refused(key, value, tmp_path, capsys):
    content = {"costs": COSTS, "reaches": twelve_reaches(), key: value}
    (tmp_path / "results.json").write_text(json.dumps(content))
    assert fit_command.main([str(tmp_path / "results.json"), "--out", str(tmp_path / "w")]) == 1
    assert f"explain the reaches with fit_ioc.py --{key}" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["", "{", "[]", '{"costs": ["speed"], "reaches": []}'])
def test_results_of_something_else_are_refused(content, tmp_path, capsys):
    (tmp_path / "results.json").write_text(content)
    assert fit_command.main([str(tmp_path / "results.json"), "--out", str(tmp_path / "w")]) == 1
    assert "results.json" in capsys.readouterr().err
