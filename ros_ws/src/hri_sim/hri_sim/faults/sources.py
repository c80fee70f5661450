"""Launched graphs whose people come from another source than the person node: replayed, a dyad, live.

Each of these sources goes on by itself, whatever the robot does, also where it was stopped in mid-way: so
its people sit farther off than those who are told when to reach, and cannot run into a robot at rest.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hri_prediction.errors import ConfigError
from hri_prediction.live.qtm_client import load_qtm_rt
from hri_prediction.live.qtm_server import QtmServer
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.faults.live import LiveGraph
from hri_sim.faults.specs import launched_specs
from hri_sim.launch.run import RunOptions
from hri_sim.launch.supervisor import NodeSpec
from hri_sim.people.seeding import training_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS
from hri_sim.people.training import training_reaches
from hri_sim.reliability.fault import Skipped
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import PersonSpec, Scenario

REPLAYER, DYAD, MOCAP_LIVE = "replayer", "dyad", "mocap_live"
SOURCES = (REPLAYER, DYAD, MOCAP_LIVE)
INTERACTION = "interaction_monitor"
"""Node that watches two people, and so runs beside a dyad."""
RECORDING = "recording.npz"
FARTHER_M = 0.5
"""So much farther from the robot than who is drawn beside it [m]."""
ARM_PLACE = f"{FARTHER_M},0,0,0"
DYAD_PLACE = f"{0.85 + FARTHER_M},0,-0.01,0"
RATE_HZ = 1e9 / SAMPLE_PERIOD_NS
MARKERS = ("RSHO", "RELB", "RWRI", "RFIN")
MARKER_MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRI,hand_tip=RFIN"


def there_and_back(scenario: Scenario) -> ArmTrack:
    """A reach of a scenario's person, and the same backwards: its end is its begin, for a loop."""
    person, wanted = scenario.persons[0], scenario.reaches[0]
    assert wanted.person_target is not None
    target = scenario.targets[wanted.person_target]
    # A gap would come back in every round, and stop the robot in some.
    seen = person.model_copy(update={"dropout_rate": 0.0, "marker_dropout_rate": 0.0})
    rng = training_generator(scenario.seed, person.id, 0)
    (reach,) = training_reaches(seen, person.home, target, 1, rng)
    keypoints = np.concatenate((reach.keypoints, reach.keypoints[::-1]))
    times = np.arange(len(keypoints)) / RATE_HZ
    return ArmTrack(times, keypoints, side=reach.side, subject=person.id, source=reach.source)


def seated_farther(person: PersonSpec, name: str) -> PersonSpec:
    """Somebody of another name, out of the robot's way."""
    places = {
        field: (getattr(person, field)[0] + FARTHER_M, *getattr(person, field)[1:])
        for field in ("shoulder", "home")
    }
    return person.model_copy(update={"id": name, **places})


def scene_of(source: str, scenario: Scenario) -> Scenario:
    """The scene with the people of a source, as the simulator is to know them.

    Who is seen live has no true arm besides, so the simulator knows of nobody.
    """
    names = {REPLAYER: ("person1",), DYAD: ("person1", "person2"), MOCAP_LIVE: ()}[source]
    alone = {"person": None, "person_target": None, "person_candidates": ()}
    return scenario.model_copy(
        update={
            "persons": tuple(seated_farther(scenario.persons[0], name) for name in names),
            "reaches": tuple(reach.model_copy(update=alone) for reach in scenario.reaches),
        }
    )


class SourceGraph(LiveGraph):
    """Node processes of a run with such a source; a context manager.

    Args:
        folder: For logs, parameters, recording and bag; it is there.
        seed: Seed of everything random.
        source: One of :data:`SOURCES`.

    Raises:
        Skipped: when a source needs what is not installed here.
    """

    def __init__(self, folder: Path, seed: int, source: str) -> None:
        drawn = draw_scenario(seed, 2)
        self._server: QtmServer | None = None
        if source == REPLAYER:
            file = (folder / RECORDING).resolve()
            save_tracks(file, [there_and_back(drawn)])
            parameters = {"file": str(file), "place": ARM_PLACE, "loop": True}
            spec = NodeSpec("hri_sim", REPLAYER, parameters)
        elif source == DYAD:
            spec = NodeSpec("hri_sim", DYAD, {"seed": seed, "place": DYAD_PLACE})
        else:
            try:
                load_qtm_rt()
            except ConfigError as error:
                raise Skipped(str(error)) from error
            places_mm = 1e3 * there_and_back(drawn).keypoints
            self._server = QtmServer(places_mm, MARKERS, rate_hz=RATE_HZ)
            spec = NodeSpec(
                "hri_prediction",
                MOCAP_LIVE,
                {"port": self._server.port, "maps": [MARKER_MAP], "place": ARM_PLACE},
            )
        scenario = scene_of(source, drawn)
        options = RunOptions(out=folder, seed=seed, drawn=scenario)
        specs = [*launched_specs(options, scenario, None, spec)]
        if source == DYAD:
            specs.append(NodeSpec("hri_prediction", INTERACTION))
        super().__init__(folder, scenario, options.mover, specs)

    def close(self) -> None:
        """End all nodes, and what one of them listens to."""
        super().close()
        if self._server is not None:
            self._server.close()
