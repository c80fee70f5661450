"""A launched experiment, each node a process: trials move the robot for as long as somebody looks on."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.pibb.session import row_of
from hri_planner.pibb.storage import SESSION, load_session
from hri_planner.robot.model import load_robot
from hri_prediction.ros.messages import AdaptationStatus
from hri_prediction.ros.qos import reliable
from hri_sim.faults.live import READY_S, LiveGraph
from hri_sim.launch.adaptation import AdaptationOptions, adaptation_specs
from hri_sim.launch.parameters import complete_parameters, read_parameters
from hri_sim.readability.scene import experiment_scenario

UPDATES = 1000
"""More than anybody looks on."""
RETURN_S = 30.0
"""So long may the robot take until it moves again after a trial [s]."""


class TrialsGraph(LiveGraph):
    """Node processes of an experiment; a context manager.

    Args:
        folder: For logs, parameters, trials and bag; it is there.
        seed: Seed of everything random.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        experiment = load_experiment(find_experiment("transfer"))
        experiment = replace(
            experiment, improvement=replace(experiment.improvement, updates=UPDATES)
        )
        options = AdaptationOptions(folder, experiment, person="ann", seed=seed)
        scenario = experiment_scenario(experiment, load_robot(), "person1")
        made = adaptation_specs(options, scenario, folder, folder / "bag")
        specs = complete_parameters(made, read_parameters(None), "")
        self._trials, self._trial = options.trials, 0
        super().__init__(folder, scenario, "policy", specs)
        self._node.create_subscription(
            AdaptationStatus, "adaptation/status", self._on_trials, reliable(10)
        )

    def _on_trials(self, message: AdaptationStatus) -> None:
        self._trial = message.trial

    def _set_out(self) -> None:
        """Trials, and ways back from them, come by themselves."""
        self.spin(RETURN_S, lambda: self.speed() > 0.1)

    def kept(self) -> list[str]:
        """The trials that are on the disk."""
        if not (self._trials / SESSION).exists():
            return []
        session, _ = load_session(self._trials)
        return [repr(row_of(result)) for result in session.state.results]

    def lost(self, before: list[str]) -> int:
        """How many of the trials that were on the disk are not there any more, or others."""
        now = self.kept()
        return sum(row not in now for row in before)

    def goes_on_after(self, since_s: float, before: list[str]) -> float | None:
        """How long after a time a further trial is done [s]; none when none is."""
        if not self.spin(READY_S, lambda: self._trial > len(before)):
            return None
        return time.time() - since_s
