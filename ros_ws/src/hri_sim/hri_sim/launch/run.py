"""One run of the graph: make the folder, start the nodes, conduct the scenario, stop, look at the bag."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from hri_planner.policy.model_file import find_any, load_any
from hri_planner.ptomp.interaction import doubts_about
from hri_planner.ptomp.variants import find_variant
from hri_prediction.errors import ConfigError
from hri_prediction.results.origin import results_origin
from hri_prediction.tracks.placement import Placement
from hri_sim.launch.conducting import conduct_nodes
from hri_sim.launch.conductor import Conductor
from hri_sim.launch.cpu_meter import CpuMeter
from hri_sim.launch.deaths import STOP
from hri_sim.launch.folder import RunFolders
from hri_sim.launch.held_signals import EndingSignals
from hri_sim.launch.learning import have_compiled, learning
from hri_sim.launch.moving_goals import Scene
from hri_sim.launch.parameters import complete_parameters, interaction_of, read_parameters
from hri_sim.launch.record import Series, read_run, with_baseline
from hri_sim.launch.run_bags import RunBags
from hri_sim.launch.scene import LIBRARY, SCENARIO, run_library, run_scene
from hri_sim.launch.separation import (
    DEFAULT_SEPARATION,
    check_stopping,
    heartbeat,
    permitted_words,
    separation_specs,
    timeouts,
)
from hri_sim.launch.summary import SUMMARY, print_table, summarise, write_summary
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.launch.telling import print_line, status_line, words_of
from hri_sim.recording.folders import bag_folders
from hri_sim.scenario.schema import Scenario, save_scenario

RECORDER_STOP_TIMEOUT_S = 30.0
"""A slow disk may still have to take much of the bag when a run ends [s]."""
AGAIN = "Ctrl-C again ends it faster, without losing the recording and the summary"


@dataclass(frozen=True)
class RunOptions:
    """What a run is made of.

    Attributes:
        out: Folder of the run; must be empty or not exist.
        bag: Bag folder; by default ``out/bag``.
        seed: Seed of everything random.
        scenario: Scenario file; none: drawn by the seed.
        reaches: Reaches of a drawn scenario; none: 3, or as many as fit a recording.
        planner: Name of the planner, one of :func:`hri_planner.ptomp.variants.live_names`.
        human: ``simulated`` or ``replay``.
        human_file: Recording to replay.
        trial: Track of it.
        place: Where it is put, ``X,Y,Z,YAW``; none: seated across the table.
        library: Task library; none: trained on simulated reaches of the scenario's tasks (replay:
            none, prediction by constant velocity).
        parameters: File with further parameters, ``{node: {parameter: value}}``.
        policy: Policy that moves the robot instead of a planner: a file, or one that ships; none: a
            planner.
        drawn: Scenario instead of a file or one drawn by the seed.
        scene: How the goals of a policy behave, one of :data:`hri_sim.launch.moving_goals.SCENES`.
        separation: What the separation monitor reckons with, one of
            :data:`hri_sim.launch.separation.SEPARATIONS`.
        on_death: What is done when a node dies, one of :data:`hri_sim.launch.deaths.ON_DEATH`.
        person: Who reaches, whom the predictor learns and keeps in a folder; none: it learns nobody.
    """

    out: Path
    bag: Path | None = None
    seed: int = 0
    scenario: Path | None = None
    reaches: int | None = None
    planner: str = "ptomp"
    human: str = "simulated"
    human_file: Path | None = None
    trial: int | None = None
    place: str | None = None
    library: Path | None = None
    parameters: Path | None = None
    policy: str | None = None
    drawn: Scenario | None = None
    scene: str = "sequence"
    separation: str = DEFAULT_SEPARATION
    on_death: str = STOP
    person: str | None = None

    @property
    def mover(self) -> str:
        """The node that moves the robot."""
        return "ptomp" if self.policy is None else "policy"

    @property
    def moved_by(self) -> str:
        """What moves the robot, for titles and files."""
        return self.planner if self.policy is None else Path(self.policy).stem


@dataclass(frozen=True)
class RunResult:
    """What came of a run.

    Attributes:
        summary: Content of ``summary.json``.
        series: The run over time; none when the recorder died before it had recorded any of it.
        bag: Bag folder.
        cpu_cores: Cores that all processes of the run kept busy while it was conducted.
    """

    summary: dict[str, Any]
    series: Series | None
    bag: Path
    cpu_cores: float


def node_specs(
    options: RunOptions,
    scenario: Scenario,
    scenario_path: Path,
    library: Path | None,
    placement: Placement | None,
    bag: Path,
) -> list[NodeSpec]:
    """The nodes of a run, each with the parameters that are not as by default."""
    common = {"scenario": str(scenario_path), "seed": options.seed}
    specs = [
        NodeSpec("hri_sim", "simulator", {**common, **timeouts(options.separation)}),
        *_mover_specs(options, scenario, library),
        *separation_specs(options.separation, scenario),
        NodeSpec(
            "hri_sim",
            "recorder",
            {
                "output": str(bag),
                "provenance": json.dumps(
                    {
                        "seed": options.seed,
                        "scenario": scenario.name,
                        "planner": options.moved_by,
                        "human": options.human,
                        "human_file": options.human_file.name if options.human_file else "",
                        "library": str(library or ""),
                    }
                ),
            },
            essential=False,
            last=True,
            own_folder="output",
            stop_timeout_s=RECORDER_STOP_TIMEOUT_S,
        ),
    ]
    if options.human == "simulated":
        specs.insert(1, NodeSpec("hri_sim", "person", common))
    else:
        assert placement is not None
        assert options.human_file is not None
        place = f"{placement.x},{placement.y},{placement.z},{math.degrees(placement.yaw)}"
        specs.insert(
            1,
            NodeSpec(
                "hri_sim",
                "replayer",
                {
                    "file": str(options.human_file.resolve()),
                    "trial": options.trial or 0,
                    "place": place,
                    "start": "cue",
                    "resample": 250.0,
                    "body_id": scenario.persons[0].id,
                },
            ),
        )
    return specs


def _mover_specs(options: RunOptions, scenario: Scenario, library: Path | None) -> list[NodeSpec]:
    """The node that moves the robot, and what it needs to know of people."""
    names = list(scenario.targets)
    scene: dict[str, Any] = {
        "target_names": names,
        "target_positions": [float(v) for name in names for v in scenario.targets[name]],
        "table_center": [float(v) for v in scenario.table.center],
        "table_size": [float(v) for v in scenario.table.size],
        **heartbeat(options.separation),
    }
    if options.policy is not None:
        policy = find_any(options.policy)
        load_any(policy)  # a wrong file is named before anything starts
        given = str(policy.resolve()) if options.policy.endswith(".npz") else options.policy
        boxes = {
            "box_centers": [float(v) for box in scenario.obstacles for v in box.center],
            "box_sizes": [float(v) for box in scenario.obstacles for v in box.size],
        }
        given_boxes = boxes if scenario.obstacles else {}
        return [NodeSpec("hri_planner", "policy", {"policy": given, **scene, **given_boxes})]
    if scenario.obstacles:
        raise ConfigError(
            f"scenario {scenario.name} has obstacles, of which planner {options.planner} knows nothing",
            expected="a scenario without, or a policy, which keeps clear of them",
        )
    variant = find_variant(options.planner)
    ptomp: dict[str, Any] = {
        "seed": options.seed,
        "variant": variant.name,
        **{f"planner.{name}": value for name, value in variant.settings.items()},
        **scene,
    }
    return [
        NodeSpec(
            "hri_prediction",
            "predictor",
            {"library": str(library) if library else "", **learning(options, scenario)},
        ),
        NodeSpec("hri_planner", "ptomp", ptomp),
    ]


def run_graph(options: RunOptions, console: Console) -> RunResult:
    """Run a scenario in the live graph, every node its own process.

    A run that is broken off, by an error or by Ctrl-C, is summed up too before that is passed on.

    Raises:
        ConfigError: when the options do not fit, or a folder cannot be written.
        NodeDeath: when a node that the run needs ended by itself.
        GraphError: when the graph did not come up, or an answer did not come.
        DataError: when the bag of a run that went well cannot be read.
        OSError: when a file of the run cannot be written: the disk is full, say.
    """
    with (
        RunFolders(options.out, options.bag, (SCENARIO, LIBRARY)) as folders,
        EndingSignals() as signals,
    ):
        return _run_graph(options, console, folders, signals)


@dataclass(frozen=True)
class Prepared:
    """What is there before any node is started.

    Attributes:
        scene: What is conducted.
        specs: The nodes, with their parameters.
    """

    scene: Scene
    specs: list[NodeSpec]


def prepare(options: RunOptions, bag: Path, console: Console) -> Prepared:
    """Scene, library and parameters of a run, checked; the files that nodes read are written.

    Raises:
        ConfigError, DataError: naming what does not fit.
    """
    scene, placement, facing = run_scene(options)
    scenario = scene.scenario
    scenario_path = (options.out / SCENARIO).resolve()
    save_scenario(scenario_path, scenario)
    library = run_library(options, scenario, facing, lambda text: print_line(console, text))
    specs = complete_parameters(
        node_specs(options, scenario, scenario_path, library, placement, bag),
        read_parameters(options.parameters),
        f"--parameters {options.parameters}",
    )
    parameters = {spec.label: spec.parameters for spec in specs}
    check_stopping(parameters, f"--parameters {options.parameters}")
    if words := permitted_words(parameters):
        print_line(console, words)
    for words in doubts_about(*interaction_of(parameters)):
        print_line(console, f"interaction_costs: {words}; they are used all the same")
    if options.person is not None:
        have_compiled(lambda text: print_line(console, text))
    return Prepared(scene, specs)


def _run_graph(
    options: RunOptions, console: Console, folders: RunFolders, signals: EndingSignals
) -> RunResult:
    bag = folders.bag
    origin = results_origin()
    prepared = prepare(options, bag, console)
    scene, scenario = prepared.scene, prepared.scene.scenario
    cpu_cores, host_share = 0.0, 0.0
    with status_line(console) as say, Supervisor(options.out) as supervisor:
        conductor = Conductor(
            scenario,
            supervisor,
            say,
            tell=lambda text: print_line(console, text),
            mover=options.mover,
            leader=scene.leader,
            on_death=options.on_death,
        )

        def work() -> None:
            nonlocal cpu_cores, host_share
            load = CpuMeter([*supervisor.pids.values(), os.getpid()])
            conductor.run()
            cpu_cores, host_share = load.cores(), load.host_share()

        ended = conduct_nodes(
            conductor,
            supervisor,
            prepared.specs,
            work,
            folders=folders,
            signals=signals,
            console=console,
            say=say,
            stopping=f"stopping; {AGAIN}",
        )
    broken = ended.broken
    reports = conductor.reports
    simulated = options.human == "simulated" and bool(scenario.persons)
    series = None
    try:
        bags = RunBags.of(bag_folders(bag) or [bag])
        series = read_run(
            bags,
            scenario,
            reports,
            sensor_delay_s=scenario.persons[0].latency if simulated else 0.0,
            title=f"{scenario.name} · {options.moved_by} · seed {options.seed}",
        )
        for text in (*bags.unread_words(), *bags.lost_words()):
            print_line(console, text)
        # A goal that moves has no nominal motion to compare with.
        if broken is None and not signals.count and scene.leader is None:
            series = replace(series, record=with_baseline(series.record))
    except Exception as error:  # a bag that ended early may be broken in any way
        if not (broken or supervisor.died("recorder") or "recorder" in ended.killed):
            raise
        print_line(console, f"no figures of the recording, which ended early: {error}")
    summary = summarise(series, reports, scenario=scenario, bag=bag, seed=options.seed)
    summary["planner"] = options.moved_by
    summary["separation"] = options.separation
    summary["person"] = options.person
    parameters = {spec.label: spec.parameters for spec in prepared.specs}
    name, file = interaction_of(parameters)
    summary["interaction_costs"], summary["interaction_file"] = name or None, file or None
    summary["stopped_s"] = conductor.stopped_s
    summary["host_share"] = host_share
    summary["origin"] = origin
    try:
        write_summary(options.out / SUMMARY, summary)
    except OSError as error:
        if broken is None:
            raise
        print_line(console, f"no {SUMMARY}: {words_of(error)}")
    if broken is not None:
        print_table(console, summary)
        raise broken
    if signals.count:
        print_table(console, summary)
        signals.pass_on()
    return RunResult(summary, series, bag, cpu_cores)
