"""An experiment in the live graph: start the nodes, watch the trials, stop, say what came of it."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from action_msgs.srv import CancelGoal
from rich.console import Console

from hri_planner.pibb.beginning import check_same, first_policy
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import save_experiment
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import SESSION, load_session
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, GraphError
from hri_prediction.results.origin import results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.ros.messages import AdaptationStatus, SimState
from hri_prediction.ros.qos import reliable
from hri_sim.launch.conducting import conduct_nodes
from hri_sim.launch.conductor import Conductor
from hri_sim.launch.deaths import STOP
from hri_sim.launch.folder import RunFolders
from hri_sim.launch.held_signals import EndingSignals
from hri_sim.launch.parameters import complete_parameters, read_parameters
from hri_sim.launch.run import RECORDER_STOP_TIMEOUT_S
from hri_sim.launch.scene import SCENARIO
from hri_sim.launch.separation import (
    DEFAULT_SEPARATION,
    check_stopping,
    heartbeat,
    separation_specs,
    timeouts,
)
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.launch.telling import print_line
from hri_sim.readability.scene import experiment_scenario
from hri_sim.scenario.schema import Scenario, save_scenario

EXPERIMENT = "experiment.yaml"
"""What is done, as the nodes read it."""
SIMULATED, LIVE = "simulated", "live"
HUMANS = (SIMULATED, LIVE)
"""Whose answers count."""
TRIALS = "trials"
"""Folder of the trials in that of an experiment."""
ADAPTATION_STOP_S = 1.0
"""So long may the adaptation node take to end when an experiment is broken off [s]."""
SILENT_S = 5.0
"""An adaptation node that says nothing for so long hangs [s]."""


@dataclass(frozen=True)
class AdaptationOptions:
    """What is run.

    Attributes:
        out: Folder of the experiment; one that holds trials is gone on with.
        experiment: What is done.
        person: Name of the person.
        seed: Seed of everything random.
        policy: Policy to begin with; none: straight ways.
        human: ``simulated``, or ``live``: whoever presses keys, or is tracked.
        population: Whom the simulated person is drawn from.
        parameters: File with further parameters of nodes.
        record: Whether a bag is recorded.
        separation: What the separation monitor reckons with, one of
            :data:`hri_sim.launch.separation.SEPARATIONS`.
        on_death: What is done when a node dies, one of :data:`hri_sim.launch.deaths.ON_DEATH`.
    """

    out: Path
    experiment: Experiment
    person: str
    seed: int
    policy: Path | None = None
    human: str = SIMULATED
    population: str = "usual"
    parameters: Path | None = None
    record: bool = True
    separation: str = DEFAULT_SEPARATION
    on_death: str = STOP

    @property
    def trials(self) -> Path:
        """Folder of the trials."""
        return self.out / TRIALS


def adaptation_specs(
    options: AdaptationOptions, scenario: Scenario, folder: Path, bag: Path | None
) -> list[NodeSpec]:
    """The nodes of an experiment, each with the parameters that are not as by default.

    Args:
        options: What is run.
        scenario: Its scene.
        folder: Gets the files that the nodes read.
        bag: Bag folder; none: nothing is recorded.
    """
    experiment = options.experiment
    scenario_path, experiment_path = (folder / SCENARIO).resolve(), (folder / EXPERIMENT).resolve()
    save_scenario(scenario_path, scenario)
    save_experiment(experiment_path, experiment)
    planner: dict[str, Any] = {
        "table_center": [float(v) for v in scenario.table.center],
        "table_size": [float(v) for v in scenario.table.size],
    }
    if not experiment.avoidance:
        planner |= {"policy_planner.field_strength": 0.0, "policy_planner.link_reach": 0.0}
    if scenario.obstacles:
        planner["box_centers"] = [float(v) for box in scenario.obstacles for v in box.center]
        planner["box_sizes"] = [float(v) for box in scenario.obstacles for v in box.size]
    specs = [
        NodeSpec(
            "hri_sim",
            "simulator",
            {
                "scenario": str(scenario_path),
                "seed": options.seed,
                **timeouts(options.separation),
            },
        ),
        NodeSpec("hri_planner", "policy", {**planner, **heartbeat(options.separation)}),
        *separation_specs(options.separation, scenario, real=options.human == LIVE),
        NodeSpec(
            "hri_planner",
            "adaptation",
            {
                "experiment": str(experiment_path),
                "folder": str(options.trials.resolve()),
                "person": options.person,
                "seed": options.seed,
                **({"policy": str(options.policy.resolve())} if options.policy else {}),
            },
        ),
    ]
    if options.human == SIMULATED:
        observer = {
            "experiment": str(experiment_path),
            "seed": options.seed,
            "population": options.population,
            "body_id": scenario.persons[0].id,
        }
        specs.insert(1, NodeSpec("hri_sim", "observer", observer))
    if bag is not None:
        specs.append(
            NodeSpec(
                "hri_sim",
                "recorder",
                {
                    "output": str(bag),
                    "provenance": json.dumps(
                        {
                            "seed": options.seed,
                            "scenario": scenario.name,
                            "planner": "policy",
                            "human": options.human,
                            "human_file": "",
                            "library": "",
                        }
                    ),
                },
                essential=False,
                own_folder="output",
                last=True,
                stop_timeout_s=RECORDER_STOP_TIMEOUT_S,
            )
        )
    return specs


class AdaptationConductor(Conductor):
    """Watches the trials; the adaptation node conducts them.

    Attributes:
        nearest_m: Smallest distance of the robot from people, as the simulator knows it, and from all else
            outside of trials that count, as the adaptation node sees it [m].
    """

    def __init__(
        self,
        scenario: Scenario,
        supervisor: Supervisor,
        say: Callable[[str], None],
        tell: Callable[[str], None],
        progress: Callable[[int, int, str], None],
        on_death: str = STOP,
    ) -> None:
        super().__init__(scenario, supervisor, say, tell, mover="policy", on_death=on_death)
        self._progress = progress
        self._trials: AdaptationStatus | None = None
        self._heard_s = 0.0
        self._news = False
        self.nearest_m = math.inf
        # An empty request: all goals.
        self._cancelling = self._node.create_client(
            CancelGoal, f"{self._action}/_action/cancel_goal"
        )
        self._node.create_subscription(
            AdaptationStatus, "adaptation/status", self._on_trials, reliable(10)
        )

    def _on_trials(self, message: AdaptationStatus) -> None:
        self._trials, self._heard_s, self._news = message, time.monotonic(), True
        self.nearest_m = min(self.nearest_m, message.between_clearance)

    def _on_state(self, message: SimState) -> None:
        super()._on_state(message)
        if self._begun:
            self.nearest_m = min(self.nearest_m, message.clearance)

    def break_off(self, reason: str) -> None:
        """Stop the robot, and who would send it on; see :meth:`Conductor.break_off`."""
        running = "adaptation" in self._supervisor.pids
        if running:
            self._cancelling.call_async(CancelGoal.Request())
            self._supervisor.end("adaptation", ADAPTATION_STOP_S)
            # It may have sent the next one meanwhile.
            self._cancelling.call_async(CancelGoal.Request())
        super().break_off(reason)

    def run(self) -> None:
        """Until the experiment is over.

        Raises:
            NodeDeath: when a node ended by itself, and is not to be started again.
            GraphError: when it is given up, or the adaptation node falls silent.
        """
        self._begun = True
        self._heard_s = time.monotonic()

        def over() -> bool:
            if self._deaths.again:
                return True
            if time.monotonic() - self._heard_s > SILENT_S:
                raise GraphError(f"the adaptation node has said nothing for {SILENT_S:.0f} s")
            status = self._trials
            if status is None:
                return False
            if self._news:
                self._news = False
                self._progress(status.trial, status.trials, _described(status))
            if status.stage == AdaptationStatus.STOPPED:
                raise GraphError(
                    f"the experiment was given up: {status.reason}",
                    hint="all trials that were done are kept: mend that, or give the machine less to do, "
                    "and the same command with the same --out goes on",
                )
            return bool(status.stage == AdaptationStatus.OVER)

        while True:
            self.spin_until(over, 24 * 3600.0, "the end of the experiment")
            if not self._deaths.again:
                return
            self._wait_for_the_dead()
            # What was said before is not said by who was started again.
            self._trials, self._heard_s = None, time.monotonic()
            self._say("trials")


def _described(status: AdaptationStatus) -> str:
    """How it goes, in a few words."""
    words = [
        "habituation" if status.update < 0 else f"update {status.update + 1} of {status.updates}"
    ]
    if status.last_trial >= 0:
        times = dict(zip(status.term_names, status.terms, strict=True))
        right = "right" if status.last_guess == status.last_goal else "wrong"
        words.append(f"{status.last_goal}: {right} after {times['prediction_time']:.2f} s")
    if status.aborted:
        words.append(f"{status.aborted} broken off")
    if status.reason:
        words.append(status.reason)
    return " · ".join(words)


@dataclass(frozen=True)
class Conducted:
    """What came of an experiment in the graph.

    Attributes:
        session: As it was saved.
        nearest_m: Smallest distance of the robot in this run that is not one of a trial that counts: as in
            :class:`AdaptationConductor` [m].
    """

    session: Session
    nearest_m: float


def run_adaptation(options: AdaptationOptions, console: Console, line: ProgressLine) -> Conducted:
    """Run an experiment, or go on with it, every node its own process.

    Raises:
        ConfigError: when the options do not fit, or a folder cannot be written.
        NodeDeath: when a node that the run needs ended by itself.
        GraphError: when the graph did not come up, or the experiment was given up.
    """
    done = check_folder(options)
    if done:
        print_line(console, f"going on with {options.out}, which holds {done} trials")
    number = 1 + sum(path.is_dir() for path in options.out.glob("run_*"))
    folder = options.out / f"run_{number}"
    scenario = experiment_scenario(
        options.experiment, load_robot(), "person1" if options.human == "simulated" else None
    )
    with RunFolders(folder, None, (SCENARIO, EXPERIMENT)) as folders, EndingSignals() as signals:
        specs = complete_parameters(
            adaptation_specs(options, scenario, folder, folders.bag if options.record else None),
            read_parameters(options.parameters),
            f"--parameters {options.parameters}",
        )
        check_stopping(
            {spec.label: spec.parameters for spec in specs}, f"--parameters {options.parameters}"
        )
        with Supervisor(folder) as supervisor:
            conductor = AdaptationConductor(
                scenario,
                supervisor,
                line.say,
                lambda text: print_line(console, text),
                line.count,
                options.on_death,
            )

            def work() -> None:
                line.say("trials")
                conductor.run()

            ended = conduct_nodes(
                conductor,
                supervisor,
                specs,
                work,
                folders=folders,
                signals=signals,
                console=console,
                say=line.say,
                stopping="stopping; what is done so far is kept: --out again goes on",
            )
        if ended.broken is not None:
            raise ended.broken
        session, _ = load_session(options.trials)
        (folder / "origin.json").write_text(json.dumps(results_origin(), indent=2) + "\n")
        return Conducted(session, conductor.nearest_m)


def check_folder(options: AdaptationOptions) -> int:
    """Check that the folder is new, or holds trials of the same person, experiment and beginning.

    Returns:
        How many trials it holds.

    Raises:
        ConfigError: when it does not.
    """
    if not (options.trials / SESSION).exists():
        if options.out.exists() and any(options.out.iterdir()):
            raise ConfigError(
                f"--out {options.out} holds other things than trials",
                expected="a new or empty folder, or that of an experiment to go on with",
                hint="choose another with --out",
            )
        return 0
    session, header = load_session(options.trials)
    first = first_policy(options.experiment, load_robot(), options.policy or "")
    check_same(
        options.out, session.experiment, header, options.experiment, first,
        person=options.person, seed=options.seed,
    )  # fmt: skip
    return len(session.state.results)
