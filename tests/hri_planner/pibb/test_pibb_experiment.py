"""Experiments are read from files, and what does not fit is named."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hri_planner.dmp.policy import HOME
from hri_planner.pibb.costs import BALANCED, JOINT, CostWeights
from hri_planner.pibb.experiment import Experiment, Improvement
from hri_planner.pibb.experiment_file import (
    experiment_of,
    find_experiment,
    load_experiment,
    shipped_experiments,
    to_mapping,
)
from hri_planner.pibb.initial import CLEAR_M
from hri_planner.policy.config import PolicyConfig
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, HriError

ROBOT = load_robot()
CONTENT: dict[str, Any] = {
    "name": "small",
    "posture": [0.0, -0.1376, 0.0, 1.9745, 0.0, -1.0, 0.0],
    "goals": {"left": [0.56, 0.24, 0.12], "right": [0.56, -0.24, 0.12]},
    "targets": {"left": [0.74, 0.32, 0.04], "right": [0.76, -0.26, 0.04]},
}


ELBOW = [float(v) for v in ROBOT.frames(np.array(CONTENT["posture"]))[1]]


def changed(**changes: Any) -> Experiment:
    return experiment_of({**CONTENT, **changes})


def box(center: list[float], size: list[float]) -> dict[str, list[float]]:
    return {"center": center, "size": size}


@pytest.mark.parametrize("name", shipped_experiments())
def test_experiments_that_ship_can_be_done(name: str) -> None:
    experiment = load_experiment(find_experiment(name))
    experiment.check(ROBOT)
    assert experiment.name == name
    policy = experiment.initial_policy(ROBOT)
    assert policy.names == tuple(experiment.goals)
    for goal, place in experiment.goals.items():
        path = policy.path(goal)
        assert np.linalg.norm(path[-1] - place) < 1e-4
        for centre, half in experiment.boxes:
            gap = np.linalg.norm(np.maximum(np.abs(path - centre) - half, 0.0), axis=1).min()
            assert gap >= ROBOT.capsule_radii[2] + CLEAR_M - 1e-3


def test_the_thesis_experiments_ship() -> None:
    assert {"preliminary_end_effector", "preliminary_joint", "transfer"} <= set(
        shipped_experiments()
    )
    ours = {name: load_experiment(find_experiment(name)) for name in shipped_experiments()}
    for name in ("preliminary_end_effector", "preliminary_joint"):
        plan = ours[name].improvement
        assert (len(ours[name].goals), plan.updates, plan.rollouts) == (4, 10, 6)
        assert 5.0 <= plan.greed <= 10.0
        assert 0.85 <= plan.decay <= 0.93
    assert ours["preliminary_end_effector"].avoidance
    assert not ours["preliminary_joint"].avoidance
    assert len(ours["transfer"].goals) == 3
    assert ours["transfer"].improvement.updates == 15
    assert ours["transfer"].weights == BALANCED
    assert ours["preliminary_joint"].weights == JOINT


def test_ways_over_obstacles_are_raised_just_so_far() -> None:
    experiment = load_experiment(find_experiment("preliminary_end_effector"))
    policy = experiment.initial_policy(ROBOT)
    least = ROBOT.capsule_radii[2] + CLEAR_M
    for name, goal in experiment.goals.items():
        path = policy.path(name)
        off = np.cross(path - policy.start, goal - policy.start)
        bent = np.linalg.norm(off, axis=1).max() / np.linalg.norm(goal - policy.start)
        if name in ("g2", "g3"):
            (centre, half), *_ = experiment.boxes
            gap = np.linalg.norm(np.maximum(np.abs(path - centre) - half, 0.0), axis=1).min()
            assert gap == pytest.approx(least, abs=0.005)
            assert bent > 0.01
        else:
            assert bent < 1e-3, "straight"


def test_an_obstacle_that_no_way_leads_over_is_said() -> None:
    """A wall between start and goal, which ways are not raised over by 60 cm."""
    goals = {"left": [0.64, 0.1, 0.2], "right": [0.64, -0.1, 0.2]}
    wall = changed(goals=goals, boxes=[box([0.5, 0.0, 0.5], [0.02, 2.0, 2.0])])
    wall.check(ROBOT)
    with pytest.raises(HriError, match="obstacle"):
        wall.initial_policy(ROBOT)


def test_what_is_left_out_is_as_usual() -> None:
    found = experiment_of(CONTENT)
    assert found.boxes.shape == (0, 2, 3)
    assert (found.response, found.avoidance, found.duration) == ("hand", True, 2.5)
    assert found.weights == BALANCED
    assert found.improvement == Improvement()


def test_an_experiment_survives_its_mapping() -> None:
    first = changed(
        boxes=[box([0.5, 0.0, 0.06], [0.08, 0.14, 0.1])],
        weights={"task": 3.0, "prediction_time": 0.5},
        improvement={"updates": 3, "greed": 5.0},
        avoidance=False,
        response="press",
        duration=3,
    )
    again = experiment_of(yaml.safe_load(yaml.safe_dump(to_mapping(first))))
    assert to_mapping(again) == to_mapping(first)
    assert again.weights == first.weights == CostWeights(task=3.0, prediction_time=0.5)
    assert again.improvement == first.improvement == Improvement(updates=3, greed=5.0)
    np.testing.assert_allclose(again.boxes, first.boxes)
    np.testing.assert_array_equal(first.boxes, [[[0.5, 0.0, 0.06], [0.04, 0.07, 0.05]]])
    for name in first.goals:
        np.testing.assert_array_equal(again.goals[name], first.goals[name])
        np.testing.assert_array_equal(again.targets[name], first.targets[name])
    assert (again.name, again.duration, again.avoidance) == ("small", 3.0, False)


GOALS, TARGETS = CONTENT["goals"], CONTENT["targets"]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"golas": {}}, "golas; expected one of name.*perhaps goals"),
        ({"weights": "heavy"}, "weights 'heavy'; expected balanced, end_effector, joint"),
        ({"weights": {"task": -1.0}}, r"CostWeights\.task = -1\.0"),
        ({"weights": {"pask": 1.0}}, "no parameter pask"),
        ({"weights": dict.fromkeys(CostWeights().__dict__, 0.0)}, "all weights of costs are 0"),
        ({"weights": 5}, "weights 5"),
        ({"weights": [1, 2, 3]}, "CostWeights|weights"),
        ({"improvement": {"updates": 0}}, r"Improvement\.updates = 0"),
        ({"improvement": {"rollouts": 1}}, r"Improvement\.rollouts = 1"),
        ({"improvement": {"speed": 1}}, "no parameter speed"),
        ({"improvement": 3}, "improvement 3"),
        ({"goals": {"left": GOALS["left"]}, "targets": {"left": TARGETS["left"]}}, "at least two"),
        ({"goals": [GOALS["left"]]}, r"goals \[\[.*expected places by name"),
        ({"goals": {**GOALS, "left": [0.5, 0.2]}}, r"goals: left \[0\.5, 0\.2\]; expected 3 finite"),
        ({"goals": {**GOALS, "left": ["a", 0, 0]}}, "goals: left"),
        ({"goals": {**GOALS, "left": [0.5, 0.2, float("nan")]}}, "goals: left .*nan"),
        ({"targets": {"left": TARGETS["left"]}}, r"targets for \['left'\]; expected for \['left', 'r"),
        ({"targets": {**TARGETS, "top": [0.8, 0.0, 0.3]}}, "targets for .*top"),
        ({"posture": [0.0] * 6}, "posture .*expected 7 finite"),
        ({"posture": "home"}, "posture 'home'"),
        ({"boxes": [{"centre": [0, 0, 0], "size": [1, 1, 1]}]}, "each with center and size"),
        ({"boxes": 3}, "boxes 3"),
        ({"boxes": [box([0.0, 0.0], [1.0, 1.0, 1.0])]}, "centre"),
        ({"boxes": [box([5.0, 0.0, 0.0], [1.0, -1.0, 1.0])]}, "size|edge"),
        ({"duration": "long"}, "duration 'long'"),
        ({"duration": 0.0}, r"duration 0\.0"),
        ({"duration": True}, "duration True"),
        ({"duration": float("nan")}, "duration nan"),
        ({"duration": float("inf")}, "duration inf"),
        ({"duration": 1e9}, "duration 1000000000"),
        ({"response": "shout"}, "response 'shout'; expected press or hand"),
        ({"avoidance": "no"}, "avoidance 'no'"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(change: dict[str, Any], match: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=match):
        changed(**change)
    path = tmp_path / "e.yaml"
    path.write_text(yaml.safe_dump({**CONTENT, **change}))
    with pytest.raises(ConfigError, match=f"e.yaml: .*({match})"):
        load_experiment(path)


@pytest.mark.parametrize("name", ["name", "posture", "goals", "targets"])
def test_what_is_missing_is_named(name: str) -> None:
    content = {key: value for key, value in CONTENT.items() if key != name}
    with pytest.raises(ConfigError, match=f"no {name}; expected"):
        experiment_of(content)


@pytest.mark.parametrize("content", [None, [], "small", 3])
def test_only_mappings_are_experiments(content: object) -> None:
    with pytest.raises(ConfigError, match="expected a mapping: name, posture"):
        experiment_of(content)


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    with pytest.raises(ConfigError, match=r"cannot read .*e\.yaml"):
        load_experiment(path)
    for content in (b"a: [1", b"\xff\xfe\x00", b"a: b: c"):
        path.write_bytes(content)
        with pytest.raises(ConfigError, match=r"cannot read .*e\.yaml"):
            load_experiment(path)


def test_names_that_no_file_has_are_answered_with_some() -> None:
    with pytest.raises(ConfigError, match=r"experiment 'transfr'; expected .* transfer"):
        find_experiment("transfr")
    assert find_experiment("some/where.yaml") == Path("some/where.yaml")
    assert find_experiment("transfer").exists()


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"boxes": [box(GOALS["left"], [0.1, 0.1, 0.1])]},
         r"left \(0\.560, 0\.240, 0\.120\) is 0\.0 cm from obstacle 0; expected at least 8\.5 cm"),
        ({"boxes": [box([0.9, 0.9, 0.9], [0.1, 0.1, 0.1]), box([0.56, -0.24, 0.0], [0.1, 0.1, 0.1])]},
         r"right .* is 7\.0 cm from obstacle 1"),
        ({"boxes": [box([0.39, 0.0, 0.33], [0.1, 0.1, 0.1])]}, "the start .* from obstacle 0"),
        ({"goals": {**GOALS, "left": [1.5, 0.0, 0.2]}}, "goal left: .*out of reach by"),
        ({"posture": [0.0, -2.5, 0.0, 1.0, 0.0, 0.0, 0.0]}, "expected angles within the joint limits"),
        ({"goals": {"left": GOALS["left"], HOME: GOALS["right"]},
          "targets": {"left": TARGETS["left"], HOME: TARGETS["right"]}}, "start"),
        ({"goals": {**GOALS, "left": GOALS["right"]}}, "left"),
        ({"targets": {"left": [0.74, 0.32, 0.04], "right": [0.74, 0.25, 0.04]}},
         r"targets of left and right are 7\.0 cm apart; expected at least 10 cm"),
        ({"targets": {**TARGETS, "left": [0.74, 0.32, -0.02]}}, "target of left is within the table"),
        ({"targets": {**TARGETS, "left": [0.8, 0.5, 0.3]}, "boxes": [box([0.8, 0.5, 0.3], [0.1] * 3)]},
         "target of left is within obstacle 0"),
        ({"targets": {**TARGETS, "right": [0.56, -0.3, 0.04]}},
         r"target of right is 10\.0 cm from the goal right; expected at least 13 cm"),
        # Beside the elbow, where neither tool nor goals are.
        ({"boxes": [box(ELBOW, [0.1] * 3)]}, "the arm is -.* cm from an obstacle or the table"),
    ],
)  # fmt: skip
def test_what_the_robot_cannot_do_is_named(change: dict[str, Any], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        changed(**change).check(ROBOT)


def test_a_key_is_pressed_wherever_the_targets_are() -> None:
    """The hand of who presses rests: it keeps no robot off its goal, and is at no target."""
    for right in ([0.56, -0.3, 0.04], [0.74, 0.25, 0.04]):
        changed(targets={**TARGETS, "right": right}, response="press").check(ROBOT)


def test_without_avoidance_the_planner_has_neither_field_nor_null_space() -> None:
    config = PolicyConfig(separation=0.2)
    assert changed().planner(config) is config
    found = changed(avoidance=False).planner(config)
    assert (found.field_strength, found.link_reach, found.separation) == (0.0, 0.0, 0.2)
    assert changed().with_(duration=4.0).duration == 4.0


def test_no_more_updates_are_averaged_than_there_are() -> None:
    with pytest.raises(
        ConfigError, match=r"averaged = 4; expected at most improvement\.updates = 3"
    ):
        Improvement(updates=3, averaged=4)
