"""People on the command line: listed, shown, renamed, forgotten; weights fitted to results."""

from __future__ import annotations

import json

import numpy as np
import pytest
from reaching import reach_of

from hri_prediction.hybrid import fit_command, people_command
from hri_prediction.hybrid.store import PERSON_FILE, PeopleStore
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.weight_file import load_process

NEAR = TaskKey("right", "rest", "near")


@pytest.fixture
def folder(person, rest, rng, tmp_path):
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=np.zeros(3)))
    PeopleStore(tmp_path).save("ann", [person.tasks[NEAR]], person.weights.own)
    return tmp_path


def run(*words):
    return people_command.main([str(word) for word in words])


def test_people_are_listed_shown_moved_and_deleted(folder, capsys):
    assert run("list", "--folder", folder) == 0
    assert "ann" in capsys.readouterr().out
    assert run("show", "ann", "--folder", folder) == 0
    assert "near_from_rest" in capsys.readouterr().out
    assert run("move", "ann", "anna", "--folder", folder) == 0
    assert run("delete", "anna", "--yes", "--folder", folder) == 0
    assert run("list", "--folder", folder) == 0
    assert "nobody" in capsys.readouterr().out


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


def test_weights_are_fitted_to_results(tmp_path, capsys):
    pytest.importorskip("sklearn")
    rng = np.random.default_rng(0)
    costs = ["hand_jerk", "joint_jerk", "energy"]
    rows = [
        {
            "error": "",
            "q_start_deg": rng.uniform(-20.0, 40.0, 3).tolist(),
            "q_end_deg": rng.uniform(0.0, 80.0, 3).tolist(),
            "alpha": rng.dirichlet([4.0, 4.0, 4.0]).tolist(),
            "sd": [0.05, 0.05, 0.05],
        }
        for _ in range(12)
    ]
    results, out = tmp_path / "results.json", tmp_path / "weights.json"
    results.write_text(json.dumps({"costs": costs, "reaches": rows}))
    assert fit_command.main([str(results), "--out", str(out), "--about", "twelve of Ann"]) == 0
    assert "12 reaches" in capsys.readouterr().out
    assert load_process(out).names == tuple(costs)
    assert json.loads(out.read_text())["origin"] == "twelve of Ann"


@pytest.mark.parametrize("content", ["", "{", "[]", '{"costs": ["speed"], "reaches": []}'])
def test_results_of_something_else_are_refused(content, tmp_path, capsys):
    (tmp_path / "results.json").write_text(content)
    assert fit_command.main([str(tmp_path / "results.json"), "--out", str(tmp_path / "w")]) == 1
    assert "results.json" in capsys.readouterr().err
