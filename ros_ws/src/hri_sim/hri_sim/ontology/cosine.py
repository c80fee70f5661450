"""Whether costs that people move by are found again: movements that are optimal for known weights."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.costs import COSTS, NUMBER, path_costs
from hri_prediction.ontology.movements import SAMPLES, SPREAD, Movement, learn_costs, movements_of
from hri_prediction.ontology.piirl import cosine
from hri_prediction.ontology.sampling import draw_around
from hri_prediction.ontology.synthetic import optimal_movement
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.sessions import DyadStudy, Session, record_session, sessions_of

FloatArray = NDArray[np.float64]

CHOSEN = 4
"""Nearness costs of a truth that count, besides smoothness."""
SMOOTHNESS_SHARE = 0.5


@dataclass(frozen=True)
class Found:
    """A truth that was sought.

    Attributes:
        session: Whose movements were bent.
        costs: Names of those that count in it.
        cosine: Between true and learnt weights, both scaled by how much each cost differs among samples.
        spread: How far samples were drawn, as a factor on the usual.
        movements: So many were learnt from.
    """

    session: Session
    costs: tuple[str, ...]
    cosine: float
    spread: float
    movements: int


def draw_truth(movements: Sequence[Movement], rng: np.random.Generator) -> FloatArray:
    """Weights (26,) of which a few count about as much as smoothness does, among what might be done."""
    features = np.concatenate(
        [
            path_costs(m.body, draw_around(m.joints, 20, SPREAD, rng), m.partner, m.step_s)
            for m in movements[:10]
        ]
    )
    scale = features.std(axis=0)
    # Of what can be told apart: parts that hardly move, or are far, cost the same whatever is done.
    known = np.flatnonzero(scale[:-1] > 0.1 * scale[:-1].max())
    chosen = rng.choice(known, min(CHOSEN, len(known)), replace=False)
    truth = np.zeros(NUMBER)
    truth[chosen] = rng.uniform(0.5, 1.5, len(chosen)) / scale[chosen]
    truth[-1] = SMOOTHNESS_SHARE / scale[-1]
    return truth


def seek(
    session: Session, study: DyadStudy, spread: float, seed: int, samples: int = SAMPLES
) -> Found:
    """Draw a truth, bend movements of a session until they are optimal for it, and learn from them.

    Args:
        session: Whose movements.
        study: Of the session.
        spread: Of the samples, as a factor on the usual.
        seed: Of the truth, and of the samples.
        samples: Drawn around each movement.
    """
    rng = np.random.default_rng(seed)
    movements = movements_of(record_session(session, study))
    truth = draw_truth(movements, rng)
    optimal = [optimal_movement(movement, truth) for movement in movements]
    found = learn_costs(optimal, rng, samples=samples, spread=spread * SPREAD, penalty=0.1)
    names = tuple(COSTS[k] for k in np.flatnonzero(truth))
    return Found(session, names, cosine(truth * found.scale, found.scaled), spread, len(optimal))


def _seek(study: DyadStudy, seed: int, numbered: tuple[int, Session]) -> tuple[int, Found]:
    number, session = numbered
    return number, seek(session, study, 1.0, seed + number)


def seek_all(
    study: DyadStudy, count: int, seed: int, workers: int, progress: Callable[[int, int], None]
) -> list[Found]:
    """Several truths, each in a session of its own, which are spread over all of the study."""
    sessions = sessions_of(study, seed)
    chosen = [sessions[(2 * k + 1) * len(sessions) // (2 * count)] for k in range(count)]
    found: dict[int, Found] = {}
    work = partial(_seek, study, seed)
    with closing(do_all(work, list(enumerate(chosen)), workers=workers)) as results:
        for number, one in results:
            found[number] = one
            progress(len(found), count)
    return [found[number] for number in sorted(found)]


def cosine_lines(sought: Sequence[Found]) -> list[str]:
    """The part of a report that says whether known costs were found again."""
    values = np.array([one.cosine for one in sought])
    text = [
        "### Costs that are known, found again\n",
        "Movements of a session are bent until they are optimal for weights that were drawn; weights are "
        "learnt from them. Cosine between both, each weight times how much its cost differs among what "
        f"might be done: median {np.median(values):.3f}, least {values.min():.3f} of {len(values)} "
        "(wanted 0.95).\n",
        "| case | movements | costs that count | cosine |",
        "| --- | --- | --- | --- |",
    ]
    text += [
        f"| {one.session.case} | {one.movements} | {', '.join(one.costs)} | {one.cosine:.3f} |"
        for one in sought
    ]
    return [*text, ""]
