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
from hri_prediction.ontology.costs import LENGTH_M
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
        recorded: Movements of people who were recorded.
        study: Of the simulated ones.
        samples: Drawn around each movement.
        penalty: λ of the weights.
        seed: Of what is drawn.
        joints: Which might have moved otherwise, of :data:`SPREADS`.
        length: Distance over which nearness falls to 1/e [m]; simulated people are bent by the usual one.
    """

    case: str
    simulated: tuple[Session, ...]
    recorded: tuple[Movement, ...]
    study: DyadStudy
    samples: int
    penalty: float
    seed: int
    joints: str = ARM
    length: float = LENGTH_M


def do_case(job: CaseJob) -> CaseCosts | None:
    """Learn a case; none when there is no movement of which all of both arms is seen."""
    movements = list(job.recorded)
    for session in job.simulated:
        # They are bent from rest to rest.
        recorded_there = movements_of(record_session(session, job.study))
        movements += [replace(movement, beyond=None) for movement in recorded_there]
    if not movements:
        return None
    case = find_case(job.case)
    rng = np.random.default_rng([job.seed, case.number])
    spread = SPREADS[job.joints]
    truth = None
    if job.simulated:
        truth, movements = avoiding(case, movements, spread, rng)
    found = learn_costs(
        movements,
        rng,
        samples=job.samples,
        spread=spread,
        length=job.length,
        penalty=job.penalty,
    )
    known = None if truth is None else nearness_cosine(truth, found)
    return CaseCosts(found.weights, found.scale, len(movements), known)


def _kept(runs: Path, numbered: tuple[int, CaseJob]) -> tuple[int, CaseCosts | None]:
    """A case by its number; what was learnt of simulated people before comes from a file."""
    number, job = numbered
    if not job.simulated:
        return number, do_case(job)

    def make() -> dict[str, Any]:
        costs = do_case(job)
        return {} if costs is None else plain_costs(costs)

    told = kept(runs, WORK, PACKAGES, repr((job, layouts_hash())), make)
    return number, costs_of(told) if told else None


def do_cases(
    jobs: Sequence[CaseJob], runs: Path, workers: int, progress: Callable[[int, int], None]
) -> list[CaseCosts | None]:
    """Learn several cases, in the order of the jobs; none of one in which no movement is seen whole.

    Args:
        jobs: Which.
        runs: Folder of what is done of simulated people, which is not done again.
        workers: Processes.
        progress: Told how many are done, of how many.
    """
    found: dict[int, CaseCosts | None] = {}
    items = list(enumerate(jobs))
    with closing(do_all(partial(_kept, runs), items, workers=workers)) as results:
        for number, costs in results:
            found[number] = costs
            progress(len(found), len(jobs))
    return [found[number] for number, _ in items]


def _movements(
    numbered: tuple[int, RecordedSession],
) -> tuple[int, tuple[Movement, ...]]:
    number, session = numbered
    tracks = tracks_of_bag(session.bag, session.bodies, session.side)
    return number, tuple(movements_of(tracks))


def recorded_movements(
    sessions: Sequence[RecordedSession], workers: int, progress: Callable[[int, int], None]
) -> list[tuple[Movement, ...]]:
    """Movements of recordings, of each once, in their order.

    Args:
        sessions: Which.
        workers: Processes.
        progress: Told how many are done, of how many.

    Raises:
        DataError: naming the bag that cannot be read.
    """
    found: dict[int, tuple[Movement, ...]] = {}
    items = list(enumerate(sessions))
    with closing(do_all(_movements, items, workers=workers)) as results:
        for number, movements in results:
            found[number] = movements
            progress(len(found), len(items))
    return [found[number] for number, _ in items]


def simulated_sessions(case: str, study: DyadStudy, people: int, seed: int) -> tuple[Session, ...]:
    """The simulated sessions that a case is learnt from: so many people in each position."""
    own = [s for s in sessions_of(study, seed) if find_case(s.case).name == case]
    return tuple(
        session
        for position in sorted({session.position for session in own})
        for session in [one for one in own if one.position == position][:people]
    )
