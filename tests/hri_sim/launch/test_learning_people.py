"""What a run tells the predictor so that it learns a person."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.hybrid import loop
from hri_prediction.motor_control import compiled_graph
from hri_sim.launch.learning import have_compiled, learning
from hri_sim.launch.run import RunOptions
from hri_sim.scenario.conditions import draw_scenario


def options(tmp_path: Path, **others: Any) -> RunOptions:
    return RunOptions(out=tmp_path, **others)


def test_nobody_is_learnt_unless_asked_for(tmp_path: Path) -> None:
    assert learning(options(tmp_path), draw_scenario(3, 2)) == {}


def test_targets_are_those_that_the_person_reaches_for(tmp_path: Path) -> None:
    scenario = draw_scenario(3, 2)
    told = learning(options(tmp_path, person="ann"), scenario)
    assert told["hybrid"]
    assert told["people"] == ["person1=ann"]
    assert set(told["target_names"]) == {reach.person_target for reach in scenario.reaches}
    assert told["target_positions"][:3] == list(scenario.targets[told["target_names"][0]])


def test_what_learns_is_compiled_before_any_node_waits_for_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []
    monkeypatch.setattr(loop, "warm_loop", lambda: said.append("compiled"))
    monkeypatch.setattr(compiled_graph, "is_prepared", lambda convention: bool(said))
    for _ in range(2):
        have_compiled(said.append)
    assert len(said) == 2
    assert said[0].startswith("compiling what learns people")
    assert said[1] == "compiled"


@pytest.mark.parametrize(
    ("others", "says"),
    [
        ({"person": "a/b"}, "letters, digits"),
        ({"person": "ann", "planner": "itomp"}, "constant velocity"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, others: dict[str, str], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        learning(options(tmp_path, **others), draw_scenario(3, 2))


def test_scenes_without_one_person_who_reaches_are_refused(tmp_path: Path) -> None:
    scenario = draw_scenario(3, 2)
    still = scenario.model_copy(
        update={
            "reaches": tuple(
                reach.model_copy(update={"person_target": None}) for reach in scenario.reaches
            )
        }
    )
    with pytest.raises(ConfigError, match="nobody reaches"):
        learning(options(tmp_path, person="ann"), still)
