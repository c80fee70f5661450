"""Faults brought about again and again, each repetition kept as soon as it is done: none is done twice."""

from __future__ import annotations

import functools
import hashlib
import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

from hri_prediction.compiled import processor
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import versions
from hri_sim.readability_report.run_folder import write_json
from hri_sim.reliability.fault import (
    PROCESSES,
    Fault,
    Measure,
    Place,
    Result,
    Skipped,
    Stays,
    Trial,
)

NODES = ("hri_sim.testing.scenes", "hri_sim.nodes.recorder_node")
"""Modules that import all nodes of launched runs: what they depend on decides about processes."""
SCRATCH, LIBRARIES = "scratch", "libraries"


def module_of(measure: Measure) -> str:
    """The module that a fault is brought about by; of a partial function, that of the innermost one."""
    while isinstance(measure, functools.partial):
        measure = measure.args[0] if callable(next(iter(measure.args), None)) else measure.func
    return measure.__module__


def mark_of(fault: Fault) -> str:
    """Stands for all that decides about what comes of a fault but its seed."""
    modules = (module_of(fault.measure), *(NODES if fault.kind == PROCESSES else ()))
    parts = (*map(dependency_hash, modules), processor(), sorted(versions().items()))
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def bring_about(
    fault: Fault,
    count: int,
    runs: Path,
    progress: ProgressLine,
    *,
    first_seed: int = 0,
    smoke: bool = False,
    workers: int = 1,
    stays: dict[str, Stays] | None = None,
    origin: str = "",
) -> Result:
    """Bring a fault about so many times, or read what came of it.

    Args:
        fault: Which.
        count: Repetitions.
        runs: Where they are kept.
        progress: Says how far it is.
        first_seed: Of the first repetition; the others follow.
        smoke: Whether a short form will do.
        workers: Processes for what needs no real time.
        stays: What stays open from one fault to the next.
        origin: Of what commit, and of what day, what is done now is.
    """
    kind = "smoke" if smoke else "full"
    folder = runs / "faults" / fault.name / f"{mark_of(fault)}_{kind}"
    seeds = range(first_seed, first_seed + count)
    found = {seed: trial for seed in seeds if (trial := _read(folder / f"{seed}.json")) is not None}
    missing = [seed for seed in seeds if seed not in found]
    progress.say(fault.title)
    progress.count(len(found), count)
    skipped = ""
    if missing:
        scratch = runs / SCRATCH / fault.name
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        place = Place(scratch, runs / LIBRARIES, smoke, workers, {} if stays is None else stays)
        try:
            for measured in fault.measure(missing, place):
                trial = replace(measured, origin=origin)
                folder.mkdir(parents=True, exist_ok=True)
                write_json(folder / f"{trial.seed}.json", asdict(trial))
                found[trial.seed] = trial
                progress.count(len(found), count)
        except Skipped as error:
            skipped = str(error)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    return Result(fault, tuple(found[seed] for seed in sorted(found)), skipped)


def _read(path: Path) -> Trial | None:
    try:
        return Trial(**json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return None
