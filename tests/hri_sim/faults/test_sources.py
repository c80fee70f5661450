"""What the other sources of people show, before any of it is launched."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.tracks.placement import Placement
from hri_sim.faults.live import LiveGraph
from hri_sim.faults.motion import SCENES
from hri_sim.faults.processes import GRAPH, live_graph
from hri_sim.faults.sources import ARM_PLACE, MOCAP_LIVE, SOURCES, scene_of, there_and_back
from hri_sim.reliability.fault import Place, Skipped
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import load_scenario, save_scenario

DRAWN = draw_scenario(SCENES[0], 2)


def test_a_loop_has_no_gap_and_no_jump() -> None:
    track = there_and_back(DRAWN)
    assert track.valid.all()
    assert np.diff(track.time_s) == pytest.approx(0.004)
    np.testing.assert_array_equal(track.keypoints[0], track.keypoints[-1])
    steps = np.linalg.norm(np.diff(track.keypoints, axis=0), axis=2)
    assert steps.max() < 0.03  # with the noise of the tracking
    hand = track.keypoints[:, 3]
    assert np.linalg.norm(hand - hand[0], axis=1).max() > 0.15  # it reaches


def test_who_goes_on_by_himself_is_out_of_the_robots_way() -> None:
    placed = there_and_back(DRAWN).transformed(Placement.parse(ARM_PLACE))
    farthest = max(DRAWN.targets[reach.robot_target][0] for reach in DRAWN.reaches)
    assert placed.keypoints[..., 0].min() > farthest + 0.2


@pytest.mark.parametrize("source", SOURCES)
def test_the_scene_of_a_source_is_one(source: str, tmp_path: Path) -> None:
    scenario = scene_of(source, DRAWN)
    save_scenario(tmp_path / "scenario.yaml", scenario)
    assert load_scenario(tmp_path / "scenario.yaml") == scenario
    assert all(reach.person_target is None for reach in scenario.reaches)
    assert [reach.robot_target for reach in scenario.reaches] == [
        reach.robot_target for reach in DRAWN.reaches
    ]


def test_without_qtm_rt_its_lines_are_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "qtm_rt", None)
    with pytest.raises(Skipped, match=r"needs qtm-rt, .*requirements/qualisys\.txt"):
        live_graph(MOCAP_LIVE, Place(tmp_path, tmp_path / "keep"))


def test_a_graph_is_closed_once_where_the_next_one_cannot_be_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Running(LiveGraph):
        def __init__(self) -> None:
            self.folder, self.closed = tmp_path / "dyad", 0

        def close(self) -> None:
            self.closed += 1

    monkeypatch.setitem(sys.modules, "qtm_rt", None)
    running = Running()
    place = Place(tmp_path, tmp_path / "keep", stays={GRAPH: running})
    for _ in range(2):
        with pytest.raises(Skipped):
            live_graph(MOCAP_LIVE, place)
    assert running.closed == 1
