"""Time steps and roll-outs chosen by the live inputs when a motion starts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from motions import finish, largest_reference_step, start_reach

from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.grid import Cell, Selection
from hri_planner.adaptation.model_file import save_model
from hri_planner.ptomp.situation import Situation
from hri_prediction.ros.messages import ReachTarget
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph


class Watched:
    """A selection that another one stands behind, and what it was asked."""

    def __init__(self, selection: Selection) -> None:
        self._selection = selection
        self.seen: list[Situation] = []

    def choose(self, situation: Situation) -> Cell:
        self.seen.append(situation)
        return self._selection.choose(situation)


def test_motions_are_planned_with_what_the_model_chooses(
    make_graph: Callable[..., Graph], scenario: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "model.npz"
    save_model(path, BestFixed(Cell(25, 15)), {})
    graph = make_graph(parameters={"ptomp": {"adaptation_model": str(path)}})
    node = graph.nodes["ptomp"]
    assert node.health()[2]["num_timesteps"] == 42
    adaptation = node.replanning._adaptation
    watched = adaptation._selection = Watched(adaptation._selection)
    graph.run(1.0)
    for index in range(2):
        result = finish(graph, start_reach(graph, scenario, index))
        assert result.outcome == ReachTarget.Result.REACHED
    figures = node.health()[2]
    assert (figures["num_timesteps"], figures["num_rollouts"]) == (25, 15)
    assert len(watched.seen) == 2
    for seen in watched.seen:
        assert seen.uncertainty > 0.0
        assert 0.0 < seen.distance < 2.0
        assert 0.0 <= seen.time_to_collision <= max(r.duration for r in scenario.reaches)
    assert max(seen.collision_cost for seen in watched.seen) > 0.0
    assert largest_reference_step(graph) < 0.02
