"""Lets people take part in the experiments, on all cores; who already has is not asked again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from typing import Any

from hri_prediction.errors import DataError
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark import workers as processes
from hri_sim.readability_report.cases import TEACHER, TEACHER_SEED, Case, case_of
from hri_sim.readability_report.run_folder import RunFolder
from hri_sim.readability_report.work import Job, do_job


def learn_missing(
    cases: Sequence[Case],
    seeds: Sequence[int],
    folder: RunFolder,
    *,
    workers: int,
    progress: ProgressLine,
    origin: Mapping[str, Any],
) -> None:
    """Do what is not yet done.

    Args:
        cases: Experiments.
        seeds: Of the people.
        folder: Of results.
        workers: Processes.
        progress: Is told how far it is.
        origin: Of what is made, for the files.
    """
    wanted = [(case, seed) for seed in seeds for case in cases]
    if any(case.taught for case in cases):
        wanted += [(TEACHER, seed + TEACHER_SEED) for seed in seeds]
    missing = [pair for pair in wanted if folder.read(*pair) is None]
    done = len(wanted) - len(missing)
    if missing:
        # Else the time that is left would be told by how long this takes.
        progress.say("compiling")
        processes.compile_kernels()
    progress.say("learning")
    progress.count(done, len(wanted))
    # Who begins with what another person taught comes after all those.
    for stage in (False, True):
        jobs = [_job(*pair, folder) for pair in missing if pair[0].taught == stage]
        if not jobs:
            continue
        with closing(processes.do_all(do_job, jobs, workers=workers)) as results:
            for result in results:
                folder.add(case_of(result.case), result, origin)
                done += 1
                progress.count(done, len(wanted))


def _job(case: Case, seed: int, folder: RunFolder) -> Job:
    taught = None
    if case.taught:
        found = folder.read(TEACHER, seed + TEACHER_SEED)
        if found is None:
            raise DataError(
                f"{folder.file(TEACHER, seed + TEACHER_SEED)} is gone or damaged",
                expected="what was just written there",
                hint="start again: what is missing is done",
            )
        taught = found[0].last
    return Job(case.name, seed, case.experiment(folder.smoke), folder.readings, taught)
