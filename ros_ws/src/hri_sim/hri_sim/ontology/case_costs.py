"""By which costs people move in a case: learnt from recordings, or from movements bent to known ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.ontology.cases import find_case
from hri_prediction.ontology.cost_file import CaseCosts, costs_of, plain_costs
from hri_prediction.ontology.movements import Movement, learn_costs, movements_of
from hri_prediction.ontology.recordings import RecordedSession, tracks_of_bag
from hri_prediction.results.kept import kept
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.avoidance import avoiding
from hri_sim.ontology.cosine import ARM, SPREADS, nearness_cosine
from hri_sim.ontology.layout_file import layouts_hash
from hri_sim.ontology.sessions import DyadStudy, Session, record_session, sessions_of

WORK = __name__
"""What is learnt hangs on what this module depends on."""
PACKAGES = ("numpy", "scipy", "numba")


@dataclass(frozen=True)
class CaseJob:
    """A case to learn, of simulated people or of recorded ones.

    Attributes:
        case: Its name.
        simulated: Sessions that are simulated.
        recorded: Sessions that were recorded.
        study: Of the simulated ones.
        samples: Drawn around each movement.
        penalty: λ of the weights.
        seed: Of what is drawn.
        joints: Which might have moved otherwise, of :data:`SPREADS`.
    """

    case: str
    simulated: tuple[Session, ...]
    recorded: tuple[RecordedSession, ...]
    study: DyadStudy
    samples: int
    penalty: float
    seed: int
    joints: str = ARM


def do_case(job: CaseJob) -> CaseCosts | None:
    """Learn a case; none when there is no movement of which all of both arms is seen."""
    movements: list[Movement] = []
    for session in job.simulated:
        # They are bent from rest to rest.
        recorded_there = movements_of(record_session(session, job.study))
        movements += [replace(movement, beyond=None) for movement in recorded_there]
    for recorded in job.recorded:
        movements += movements_of(tracks_of_bag(recorded.bag, recorded.bodies, recorded.side))
    if not movements:
        return None
    case = find_case(job.case)
    rng = np.random.default_rng([job.seed, case.number])
    spread = SPREADS[job.joints]
    truth = None
    if job.simulated:
        truth, movements = avoiding(case, movements, spread, rng)
    found = learn_costs(movements, rng, samples=job.samples, spread=spread, penalty=job.penalty)
    known = None if truth is None else nearness_cosine(truth, found)
    return CaseCosts(found.weights, found.scale, len(movements), known)


def _kept(runs: Path, job: CaseJob) -> tuple[str, CaseCosts | None]:
    """A case by name; what was learnt of simulated people before comes from a file."""
    if job.recorded:
        return job.case, do_case(job)

    def make() -> dict[str, Any]:
        costs = do_case(job)
        return {} if costs is None else plain_costs(costs)

    told = kept(runs, WORK, PACKAGES, repr((job, layouts_hash())), make)
    return job.case, costs_of(told) if told else None


def do_cases(
    jobs: Sequence[CaseJob], runs: Path, workers: int, progress: Callable[[int, int], None]
) -> dict[str, CaseCosts | None]:
    """Learn several cases, in the order of the jobs; none of one in which no movement is seen whole.

    Args:
        jobs: Which.
        runs: Folder of what is done of simulated people, which is not done again.
        workers: Processes.
        progress: Told how many are done, of how many.
    """
    found: dict[str, CaseCosts | None] = {}
    with closing(do_all(partial(_kept, runs), jobs, workers=workers)) as results:
        for name, costs in results:
            found[name] = costs
            progress(len(found), len(jobs))
    return {job.case: found[job.case] for job in jobs}


def simulated_sessions(case: str, study: DyadStudy, people: int, seed: int) -> tuple[Session, ...]:
    """The simulated sessions that a case is learnt from: so many people in each position."""
    own = [s for s in sessions_of(study, seed) if find_case(s.case).name == case]
    return tuple(
        session
        for position in sorted({session.position for session in own})
        for session in [one for one in own if one.position == position][:people]
    )
