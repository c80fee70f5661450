"""What a run is told about the library that it is given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hri_prediction.tracks.files import save_tracks
from hri_sim.launch.run import RunOptions
from hri_sim.launch.scene import run_library, run_scene, scenario_library
from hri_sim.people.training import scenario_training
from hri_sim.scenario.schema import save_scenario
from hri_sim.scenario.shipped import load_shipped


def test_a_recording_turned_from_the_library_is_warned_of(tmp_path: Path) -> None:
    scenario = load_shipped("table_reach")
    rng = np.random.default_rng(0)
    (track, *_), *_ = scenario_training(scenario, 0, rng).values()
    save_tracks(tmp_path / "reach.npz", [track])
    library = scenario_library(scenario, 0)
    assert library is not None
    replace(library, place="auto", facing_deg=(180.0,)).save(tmp_path / "library.npz")
    options = RunOptions(
        out=tmp_path / "run",
        human="replay",
        human_file=tmp_path / "reach.npz",
        library=tmp_path / "library.npz",
        scenario=tmp_path / "scene.yaml",
    )
    save_scenario(tmp_path / "scene.yaml", scenario)
    for place, warned in ((None, False), ("5,0,0,0", False), ("0,0,0,90", True)):
        given = replace(options, place=place)
        _, _, facing = run_scene(given)
        said: list[str] = []
        run_library(given, scenario, facing, said.append)
        assert said[0].endswith("trained with --place auto (people face 180 degrees)")
        assert [text[:8] for text in said[1:]] == (["warning:"] if warned else [])
