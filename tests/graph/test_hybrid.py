"""The hybrid predictor in the graph: a person never seen is predicted, learnt, and known the next time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from motions import PREDICTION

from hri_prediction.errors import ConfigError
from hri_prediction.hybrid.store import PeopleStore
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.ros.learning import _people_of, targets_of
from hri_prediction.ros.messages import LoadModel
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue


def learning(scenario: Scenario, folder: Path) -> dict[str, Any]:
    names = sorted({reach.person_target for reach in scenario.reaches if reach.person_target})
    return {
        "hybrid": True,
        "target_names": names,
        "target_positions": [float(v) for name in names for v in scenario.targets[name]],
        "people_folder": str(folder),
        "people": ["person1=anna"],
    }


def reach(graph: Graph, scenario: Scenario) -> tuple[str, ...]:
    """Have the first reach done; names of the tasks that were thought possible at its end."""
    graph.run(0.6)
    cue(graph, scenario, 0)
    graph.run(3.0)
    reaching = [m for m in graph.messages(PREDICTION) if m.state == m.REACHING and m.tasks]
    assert reaching
    return tuple(reaching[-1].tasks)


def test_a_person_is_guessed_learnt_and_known_again(
    make_graph: Callable[..., Graph], scenario: Scenario, tmp_path: Path
) -> None:
    people = tmp_path / "people"
    target = scenario.reaches[0].person_target
    for seen in (1, 2):
        graph = make_graph(library=None, parameters={"predictor": learning(scenario, people)})
        names = reach(graph, scenario)
        assert f"{target}_from_rest" in names
        (known,) = PeopleStore(people).people()
        assert known.name == "anna"
        assert known.reaches == {f"right {target}_from_rest": seen}
        figures = graph.nodes["predictor"].health()[2]
        assert figures["hybrid"] == "running"
        assert figures[f"anna right {target}_from_rest"].startswith(f"{seen} reach")
        graph.close()


@pytest.mark.parametrize(
    ("names", "positions", "says"),
    [
        ((), (), "one or more"),
        (("a",), (1.0, 2.0), "2 target_positions"),
        (("a", "a"), (0.0,) * 6, "each once"),
        (("a b",), (0.0,) * 3, "letters"),
        (("a",), (0.0, 0.0, float("nan")), "not finite"),
    ],
)
def test_targets_that_do_not_fit_are_refused(
    names: tuple[str, ...], positions: tuple[float, ...], says: str
) -> None:
    with pytest.raises(ConfigError, match=says):
        targets_of(names, positions)


@pytest.mark.parametrize(
    "pairs", [("a",), ("=ann",), ("a=ann", "b=ann"), ("a=ann", "a=bo"), ("a=../x",)]
)
def test_names_that_do_not_fit_are_refused(pairs: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError, match=r"people|person"):
        _people_of(pairs)


def test_a_model_that_is_loaded_leaves_what_was_learnt(
    make_graph: Callable[..., Graph], scenario: Scenario, library: Path, tmp_path: Path
) -> None:
    graph = make_graph(library=None, parameters={"predictor": learning(scenario, tmp_path)})
    graph.run(0.6)
    predictor = graph.nodes["predictor"]
    response = predictor._on_load_model(LoadModel.Request(path=str(library)), LoadModel.Response())
    assert response.success
    graph.run(0.1)
    names = {
        task.name
        for body in predictor._bodies.values()
        for arm in body.arms.values()
        for task in arm.predictor.library.tasks
    }
    assert f"{scenario.reaches[0].person_target}_from_rest" in names
    assert names > {task.name for task in TaskLibrary.load(library).tasks}
