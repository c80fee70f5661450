"""Time steps and roll-outs chosen by the live inputs when a motion starts."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from motions import finish, largest_reference_step, start_reach

from hri_planner.adaptation.grid import Cell, Selection
from hri_planner.adaptation.model_file import find_model
from hri_planner.nodes import replanning
from hri_planner.ptomp.situation import Situation
from hri_prediction.ros.messages import ReachTarget
from hri_sim.benchmark.adapted import ADAPTED
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph

MODELS = {name: model for name, _, model in ADAPTED}


class Watched:
    """A selection that another one stands behind; remembers what it was asked and what it chose."""

    def __init__(self, selection: Selection) -> None:
        self._selection = selection
        self.seen: list[Situation] = []
        self.chosen: list[Cell] = []

    def choose(self, situation: Situation) -> Cell:
        self.seen.append(situation)
        self.chosen.append(self._selection.choose(situation))
        return self.chosen[-1]


@pytest.mark.parametrize("planner", ["ptomp_adapted", "ptomp_gpr"])
def test_motions_are_planned_with_what_a_model_that_ships_chooses(
    planner: str,
    make_graph: Callable[..., Graph],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[Watched] = []

    def find(name: str) -> Selection:
        asked.append(Watched(find_model(name)))
        return asked[-1]

    monkeypatch.setattr(replanning, "find_model", find)
    graph = make_graph(parameters={"ptomp": {"adaptation_model": MODELS[planner]}})
    sizes: list[Cell] = []

    def note(message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.endswith("ptomp"):
                values = {pair.key: pair.value for pair in status.values}
                sizes.append(Cell(int(values["num_timesteps"]), int(values["num_rollouts"])))

    graph.nodes["person"].create_subscription(DiagnosticArray, "/diagnostics", note, 10)
    graph.run(1.0)
    (watched,) = asked
    for index in range(2):
        assert len(watched.seen) == index
        result = finish(graph, start_reach(graph, scenario, index))
        assert result.outcome == ReachTarget.Result.REACHED
        graph.run(1.1)  # /diagnostics tell once a second
        assert sizes[-1] == watched.chosen[-1]
    assert sizes[0] == Cell(42, 30)  # before the first motion, as configured
    assert len(watched.seen) == 2
    for seen in watched.seen:
        assert seen.uncertainty > 0.0
        assert 0.0 < seen.distance < 2.0
        assert 0.0 <= seen.time_to_collision <= max(r.duration for r in scenario.reaches)
    assert max(seen.collision_cost for seen in watched.seen) > 0.0
    assert largest_reference_step(graph) < 0.02
