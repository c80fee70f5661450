"""What a run begins with: its scene, where a recording is put in it, and the predictor's library."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hri_planner.ptomp.variants import find_variant
from hri_prediction.errors import ConfigError
from hri_prediction.prediction.facing import facing_warning
from hri_prediction.prediction.library import TaskLibrary, train_library
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg, suggest_placement
from hri_sim.launch.folder import naming
from hri_sim.launch.moving_goals import SCENES, Scene, draw_scene
from hri_sim.people.seeding import training_generator
from hri_sim.people.training import scenario_training
from hri_sim.scenario.recorded import recorded_scenario
from hri_sim.scenario.schema import Scenario, load_scenario

if TYPE_CHECKING:
    from hri_sim.launch.run import RunOptions

SCENARIO, LIBRARY = "scenario.yaml", "library.npz"
"""Files that a run leaves in its folder before its nodes start."""


def run_scene(options: RunOptions) -> tuple[Scene, Placement | None, float | None]:
    """Scenario of the run, where a recording is put, and where its person then faces [deg].

    Raises:
        ConfigError, DataError: naming the option that does not fit, or whose file cannot be used.
    """
    if options.reaches is not None and options.reaches < 1:
        raise ConfigError(
            f"--reaches {options.reaches}", expected="at least 1", hint="give more, or leave it out"
        )
    if options.scene not in SCENES:
        raise ConfigError(f"--scene {options.scene}", expected="one of " + ", ".join(SCENES))
    drawn = options.human == "simulated" and options.scenario is None
    if options.scene != "sequence" and not drawn:
        raise ConfigError(
            f"--scene {options.scene} with a recording or a --scenario",
            expected="sequence: in the others people and goals are drawn",
            hint="leave --scene out, or --human and --scenario",
        )
    if options.human == "simulated":
        for name in ("human_file", "trial", "place"):
            if getattr(options, name) is not None:
                raise ConfigError(
                    f"--{name.replace('_', '-')} with a simulated person",
                    hint="give --human replay as well",
                )
        if options.scenario is not None:
            if options.reaches is not None:
                raise ConfigError(
                    "--reaches with a --scenario", hint="the scenario file says how many there are"
                )
            return Scene(_read_scenario(options.scenario)), None, None
        if options.drawn is not None:
            return Scene(options.drawn), None, None
        return draw_scene(options.scene, options.seed, options.reaches or 3), None, None
    if options.human_file is None:
        raise ConfigError(
            "--human replay without --human-file",
            expected="a recording: a mocap bag or a track file",
            hint="give --human-file FILE",
        )
    with naming("--human-file", options.human_file):
        tracks = load_tracks(options.human_file)
    trial = options.trial or 0
    if not 0 <= trial < len(tracks):
        raise ConfigError(
            f"--trial {trial}",
            expected=f"0 to {len(tracks) - 1}",
            hint=f"--human-file {options.human_file} holds {len(tracks)} trials",
        )
    track = tracks[trial]
    if options.place:
        with naming("--place", options.place):
            placement = Placement.parse(options.place)
    else:
        with naming("--human-file", options.human_file):
            placement = suggest_placement(track)
    with naming("--human-file", options.human_file):
        facing = facing_deg(track, placement)
    placed = track.transformed(placement)
    if options.scenario is not None:
        return Scene(_read_scenario(options.scenario)), placement, facing
    if options.drawn is not None:
        return Scene(options.drawn), placement, facing
    return Scene(recorded_scenario(placed, options.seed, options.reaches)), placement, facing


def _read_scenario(path: Path) -> Scenario:
    with naming("--scenario", path):
        return load_scenario(path)


def run_library(
    options: RunOptions, scenario: Scenario, facing: float | None, tell: Callable[[str], None]
) -> Path | None:
    """The task library of the predictor, trained here when none is given.

    Args:
        options: Options of the run.
        scenario: Its scenario.
        facing: Where the person of a recording faces [deg].
        tell: Takes a line about a library that is given, and one when it does not suit.

    Raises:
        ConfigError: when the planner is one that is told of constant velocity.
        DataError: when it cannot be read.
    """
    if options.policy is not None:
        return None
    learnt = find_variant(options.planner).prediction == "promp"
    if options.library is not None:
        if not learnt:
            raise ConfigError(
                f"--library with --planner {options.planner}",
                expected="no library: it is told that a reach goes on at constant velocity",
                hint="leave --library out, or use another planner",
            )
        with naming("--library", options.library):
            given = TaskLibrary.load(
                options.library
            )  # a wrong file is named before anything starts
        tell(f"--library {options.library}: {given.placed}")
        if facing is not None and (warning := facing_warning(given, facing)):
            tell(f"warning: {warning}")
        return options.library.resolve()
    if options.human != "simulated" or not learnt or options.person is not None:
        return None
    library = scenario_library(scenario, options.seed)
    if library is None:
        return None
    path = (options.out / LIBRARY).resolve()
    library.save(path)
    return path


def scenario_library(scenario: Scenario, seed: int) -> TaskLibrary | None:
    """A task library trained on simulated reaches of a scenario's tasks; none when nobody reaches."""
    tracks = []
    for index in range(len(scenario.reaches)):
        if scenario.reaches[index].person_target is None:
            continue
        rng = training_generator(seed, scenario.person_of(index).id, index)
        for group in scenario_training(scenario, index, rng).values():
            tracks += group
    return train_library(tracks) if tracks else None
