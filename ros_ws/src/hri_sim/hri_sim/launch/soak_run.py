"""One soak: start the graph, let it run with faults, stop it, look at what is left of it."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hri_prediction.results.origin import results_origin
from hri_sim.launch.conducting import conduct_nodes
from hri_sim.launch.deaths import RESTART
from hri_sim.launch.folder import RunFolders
from hri_sim.launch.held_signals import EndingSignals
from hri_sim.launch.run import RunOptions, prepare
from hri_sim.launch.scene import LIBRARY, SCENARIO
from hri_sim.launch.separation import DEFAULT_SEPARATION, contact_speed
from hri_sim.launch.soak_conductor import SoakConductor
from hri_sim.launch.supervisor import Supervisor
from hri_sim.launch.telling import print_line, status_line, why_broken
from hri_sim.recording.folders import bag_folders
from hri_sim.soak.ending import check_bag
from hri_sim.soak.faults import ALL, chosen_kinds
from hri_sim.soak.log import BEGIN, END, LOG, SoakLog
from hri_sim.soak.sampler import Sampler, check_disk
from hri_sim.soak.ways import soak_scenario

MB_A_MINUTE = 25.0
"""Somewhat more than a bag takes [MB/min]; so much must be free before a soak begins."""
SAY_S = 10.0
"""A file gets a line about how it goes this often at most [s]."""
ORPHANS_S = 3.0
"""Processes may take so long to be gone after they were stopped [s]."""


@dataclass(frozen=True)
class SoakOptions:
    """What is run.

    Attributes:
        out: Folder of the run; new or empty.
        minutes: For how long [min].
        seed: Of scene, goals and faults.
        faults: Those that are asked for, see :func:`hri_sim.soak.faults.chosen_kinds`.
        mean_wait_s: Mean time between them [s].
        separation: See :class:`hri_sim.launch.run.RunOptions`.
    """

    out: Path
    minutes: float
    seed: int = 0
    faults: str = ALL
    mean_wait_s: float = 20.0
    separation: str = DEFAULT_SEPARATION


def run_soak(options: SoakOptions, console: Console) -> None:
    """Run a soak; leaves its record in the folder, however it ends once it has begun.

    Raises:
        ConfigError: when options do not fit, the folder cannot be used, or the disk has too little room.
        GraphError: when the graph did not come up or got stuck.
    """
    kinds = chosen_kinds(options.faults)
    run = RunOptions(
        out=options.out,
        seed=options.seed,
        drawn=soak_scenario(options.seed),
        separation=options.separation,
        on_death=RESTART,
    )
    with (
        RunFolders(run.out, None, (SCENARIO, LIBRARY, LOG)) as folders,
        EndingSignals() as signals,
    ):
        # A folder that cannot be written says so first, and not that its disk is full.
        check_disk(options.out, MB_A_MINUTE * options.minutes)
        prepared = prepare(run, folders.bag, console)
        labels = tuple(spec.label for spec in prepared.specs)
        sampler = Sampler(folders.bag)
        with SoakLog(run.out / LOG) as log:
            log.write(
                BEGIN,
                {
                    "origin": results_origin(),
                    "minutes": options.minutes,
                    "seed": options.seed,
                    "faults_asked": options.faults,
                    "mean_wait_s": options.mean_wait_s,
                    "separation": options.separation,
                    "contact_speed": contact_speed(options.separation),
                    "nodes": labels,
                },
            )
            with status_line(console, SAY_S) as say, Supervisor(run.out) as supervisor:
                conductor = SoakConductor(
                    prepared.scene.scenario,
                    supervisor,
                    say,
                    lambda text: print_line(console, text),
                    log=log,
                    sampler=sampler,
                    seconds=60.0 * options.minutes,
                    seed=options.seed,
                    kinds=kinds,
                    labels=labels,
                    mean_wait_s=options.mean_wait_s,
                )
                ended = conduct_nodes(
                    conductor,
                    supervisor,
                    prepared.specs,
                    conductor.run,
                    folders=folders,
                    signals=signals,
                    console=console,
                    say=say,
                    stopping="stopping; the report is of what there was",
                )
                say("reading the bags")
                bags = [
                    check_bag(folder, lambda: bool(signals.count))
                    for folder in bag_folders(folders.bag)
                ]
            log.write(
                END,
                {
                    "broken": "" if ended.broken is None else why_broken(ended.broken),
                    "killed": ended.killed,
                    "orphans": _orphans(sampler),
                    "shared_left": sampler.shared_left(),
                    "bags": bags,
                    "not_finite": int(conductor.not_finite),
                },
            )
        if ended.broken is not None:
            raise ended.broken
        signals.pass_on()


def _orphans(sampler: Sampler) -> list[str]:
    """Processes of the run that are there in spite of all."""
    end = time.monotonic() + ORPHANS_S
    while (left := sampler.orphans(os.getpid())) and time.monotonic() < end:
        time.sleep(0.1)
    return left
