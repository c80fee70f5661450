"""Whether costs that people move by are found again: movements that are optimal for known weights.

Cosines are those between the weights of nearness alone, each times how much its cost differs among what
might have been done: with unsmoothness among them, which is always found, they would be near 1 though no
nearness was. Two parts whose nearest points are always their ends, forearms and wrists for instance, have
one cost under two names: nobody can tell how much of its weight is whose. So besides there are cosines of
weights of which those of costs that are the same in all that might have been done are added up.

Around a movement that is optimal the costs of what else might have been done differ by its own roughness,
to second order, and by how it leans towards what is avoided, which cancels to first order for the true
weights alone. So the nearer others are drawn, the better the true weights are known, as far as movements
are optimal.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.ontology.costs import COSTS, NUMBER
from hri_prediction.ontology.features import COUNT
from hri_prediction.ontology.movements import (
    ARM_SPREAD,
    PENALTY,
    SAMPLES,
    SPREAD,
    Movement,
    cost_differences,
    cost_scale,
    learn_costs,
    movements_of,
)
from hri_prediction.ontology.piirl import Learnt, cosine
from hri_prediction.ontology.sampling import draw_around
from hri_prediction.ontology.synthetic import optimal_movement
from hri_prediction.results.kept import kept
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.avoidance import SMOOTHNESS_SHARE
from hri_sim.ontology.captured import captured
from hri_sim.ontology.layout_file import layouts_hash
from hri_sim.ontology.sessions import DyadStudy, Session, record_session, sessions_of

FloatArray = NDArray[np.float64]

WORK = __name__
"""What is found hangs on what this module depends on."""
PACKAGES = ("numpy", "scipy", "numba")
CHOSEN = 4
"""Nearness costs of a truth that count, besides smoothness."""
ALL_JOINTS, ARM = "all", "arm"
SPREADS = {ALL_JOINTS: SPREAD, ARM: ARM_SPREAD}
"""How far movements are drawn that might have been, by the joints that might have moved otherwise."""
NEAR = 0.03
"""Around movements that are optimal they are drawn so many times as far. Weights that tell them apart are
larger in proportion, and the penalty is smaller: else none would be worth it. Chosen by sixteen truths,
none of which is among those that are reported."""
SAME = 1e-3
"""Costs that differ by no more than this share of themselves in all that might have been done are one."""
LOOSE = 3.0
"""How far from the optimum those are who are not quite optimal, in multiples of 1 mm and 3 mrad."""
WANTED = 0.95
"""Of cosines, where joints are known."""
KINDS = {
    "known": "joints known",
    "loose": "not quite optimal",
    "seen": "as motion capture sees it",
}
"""What is learnt from, with words for it."""


@dataclass(frozen=True)
class Found:
    """A truth that was sought.

    Attributes:
        session: Whose movements were bent.
        joints: Which moved otherwise, of :data:`SPREADS`.
        costs: Names of the nearness costs that count in it.
        bend: How far keypoints are moved by the nearness that is avoided, the median movement [m].
        cosines: Between true and learnt weights of nearness for each of :data:`KINDS`: of the joints that
            people moved by; of movements drawn around the optimal ones; of joints that were reckoned from
            keypoints with the noise of motion capture.
        merged: The same with the weights of costs that are the same added up.
        different: So many of the 25 costs are not the same as another one.
        agreement: Cosine, about zero, of true and learnt nearness costs of what might have been done beside
            what was, for each.
        flat: The same of weights that are all equal: what no learning has.
        movements: So many were learnt from.
    """

    session: Session
    joints: str
    costs: tuple[str, ...]
    bend: float
    cosines: dict[str, float]
    merged: dict[str, float]
    different: int
    agreement: dict[str, float]
    flat: float
    movements: int


def same_costs(differences: FloatArray) -> NDArray[np.int64]:
    """For each cost the first one that is the same (m,).

    Args:
        differences: Costs of what might have been done, less those of what was (s, m).
    """
    sizes = np.linalg.norm(differences, axis=0)
    found = np.arange(differences.shape[1])
    for index in range(len(found)):
        off = np.linalg.norm(differences[:, :index] - differences[:, [index]], axis=0)
        same = np.flatnonzero(off <= SAME * sizes[index])
        if len(same):
            found[index] = found[same[0]]
    return found


def nearness_cosine(
    truth: FloatArray, found: Learnt, same: NDArray[np.int64] | None = None
) -> float:
    """Cosine between true weights (26,) and learnt ones, of nearness alone, both scaled.

    Args:
        truth: True weights.
        found: Learnt ones.
        same: For each nearness the first one that is the same (25,); none: all are by themselves.
    """
    first = np.arange(COUNT) if same is None else same
    one, other = np.zeros(COUNT), np.zeros(COUNT)
    np.add.at(one, first, (truth * found.scale)[:COUNT])
    np.add.at(other, first, found.scaled[:COUNT])
    return cosine(one, other)


def learn_near(
    movements: Sequence[Movement],
    rng: np.random.Generator,
    spread: FloatArray,
    samples: int = SAMPLES,
) -> Learnt:
    """Weights of movements that are optimal, by what might have been done very near to them."""
    return learn_costs(
        movements, rng, samples=samples, spread=NEAR * spread, penalty=NEAR * PENALTY
    )


def draw_truth(
    movements: Sequence[Movement], spread: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Weights (26,) of which a few count, each some twentieth of smoothness, among what might be done.

    Only nearness that differs there by more than a tenth of that which differs most is drawn. Movements are
    those that are yet to be bent.
    """
    scale = cost_scale(movements[:10], rng, spread)
    # Parts that hardly move, or are far, cost the same whatever is done.
    known = np.flatnonzero(scale[:COUNT] > 0.1 * scale[:COUNT].max())
    chosen = rng.choice(known, min(CHOSEN, len(known)), replace=False)
    truth = np.zeros(NUMBER)
    truth[chosen] = rng.uniform(0.5, 1.5, len(chosen)) / scale[chosen]
    truth[COUNT] = SMOOTHNESS_SHARE / scale[COUNT]
    return truth


def seek(
    session: Session,
    study: DyadStudy,
    joints: str,
    seed: int | Sequence[int],
    samples: int = SAMPLES,
) -> Found:
    """Draw a truth, bend movements of a session until they are optimal for it, and learn from them.

    Args:
        session: Whose movements.
        study: Of the session.
        joints: Which may move otherwise, of :data:`SPREADS`.
        seed: Of the truth, and of the samples.
        samples: Drawn around each movement.
    """
    rng = np.random.default_rng(seed)
    spread = SPREADS[joints]
    free = spread > 0.0
    # They are bent from rest to rest.
    movements = [replace(m, beyond=None) for m in movements_of(record_session(session, study))]
    truth = draw_truth(movements, spread, rng)
    alone = np.where(np.arange(NUMBER) < COUNT, 0.0, truth)
    optimal, smoothest = (
        [optimal_movement(movement, weights, free=free) for movement in movements]
        for weights in (truth, alone)
    )
    far = LOOSE * np.where(free, [0.001] * 3 + [0.003] * 11, 0.0)
    shown = {
        "known": optimal,
        "loose": [replace(m, joints=draw_around(m.joints, 1, far, rng)[0]) for m in optimal],
        "seen": [captured(movement, study.noise, rng) for movement in optimal],
    }
    learnt = {
        kind: learn_near(some, rng, spread, samples)
        if kind == "known"
        else learn_costs(some, rng, samples=samples, spread=spread)
        for kind, some in shown.items()
    }
    differences = cost_differences(optimal[:10], rng, spread)[:, :COUNT]
    same = same_costs(cost_differences(optimal, rng, NEAR * spread)[:, :COUNT])

    def agreement(weights: FloatArray) -> float:
        return cosine(differences @ truth[:COUNT], differences @ weights[:COUNT])

    return Found(
        session,
        joints,
        tuple(COSTS[k] for k in np.flatnonzero(truth[:COUNT])),
        float(np.median([_apart(*pair) for pair in zip(optimal, smoothest, strict=True)])),
        {kind: nearness_cosine(truth, found) for kind, found in learnt.items()},
        {kind: nearness_cosine(truth, found, same) for kind, found in learnt.items()},
        len(set(same.tolist())),
        {kind: agreement(found.weights) for kind, found in learnt.items()},
        agreement(np.ones(NUMBER)),
        len(optimal),
    )


def _apart(one: Movement, other: Movement) -> float:
    """How far keypoints of two movements of the same person are apart at most [m]."""
    between = one.body.keypoints(one.joints) - other.body.keypoints(other.joints)
    return float(np.linalg.norm(between, axis=-1).max())


_Job = tuple[int, str, Session]


def _seek(study: DyadStudy, seed: int, runs: Path, job: _Job) -> tuple[_Job, Found]:
    number, joints, session = job

    def make() -> dict[str, Any]:
        found = asdict(seek(session, study, joints, (number, seed)))
        del found["session"]
        return found

    key = repr((study, session, joints, (number, seed), layouts_hash()))
    told = kept(runs, WORK, PACKAGES, key, make)
    return job, Found(session, **{**told, "costs": tuple(told["costs"])})


def seek_all(
    study: DyadStudy,
    count: int,
    seed: int,
    runs: Path,
    workers: int,
    progress: Callable[[int, int], None],
) -> list[Found]:
    """Several truths, each in a session of its own, which are spread over all of the study.

    Args:
        study: Of the sessions.
        count: Of truths of all joints, and of as many of the arm alone.
        seed: Of the sessions, and with its number of each truth.
        runs: Folder of what is done, which is not done again.
        workers: Processes.
        progress: Told how many are done, of how many.
    """
    sessions = sessions_of(study, seed)
    chosen = [sessions[(2 * k + 1) * len(sessions) // (2 * count)] for k in range(count)]
    jobs = [(k, joints, session) for joints in SPREADS for k, session in enumerate(chosen)]
    found: dict[_Job, Found] = {}
    with closing(do_all(partial(_seek, study, seed, runs), jobs, workers=workers)) as results:
        for job, one in results:
            found[job] = one
            progress(len(found), len(jobs))
    return [found[job] for job in jobs]


def cosine_results(sought: Sequence[Found]) -> dict[str, float | None]:
    """For ``results.json``: medians and the least of each kind; none where nothing was sought."""
    if not sought:
        return {"piirl_cosine": None}
    found: dict[str, float | None] = {}
    for joints in SPREADS:
        own = [one for one in sought if one.joints == joints]
        for kind in KINDS:
            name = "".join(
                ("" if joints == ALL_JOINTS else "_arm", "" if kind == "known" else f"_{kind}")
            )
            cosines = [one.cosines[kind] for one in own]
            found[f"piirl_cosine{name}"] = round(float(np.median(cosines)), 4)
            found[f"piirl_cosine{name}_least"] = round(min(cosines), 4)
            found[f"piirl_cosine{name}_share"] = round(_share(cosines), 4)
            merged = [one.merged[kind] for one in own]
            found[f"piirl_cosine{name}_merged"] = round(float(np.median(merged)), 4)
            agreed = [one.agreement[kind] for one in own]
            found[f"piirl_agreement{name}"] = round(float(np.median(agreed)), 4)
            flat = [one.flat for one in own]
            found[f"piirl_agreement{name}_better_than_equal"] = round(
                float(np.mean(np.array(agreed) > np.array(flat))), 4
            )
    return found


def _share(cosines: Sequence[float]) -> float:
    """How many are as wanted, as a share."""
    return float(np.mean(np.array(cosines) >= WANTED))


def cosine_lines(sought: Sequence[Found], about: str) -> list[str]:
    """The part of a report that says whether known costs were found again.

    Args:
        sought: Which were sought.
        about: What the movements are of.
    """
    text = [
        "### Costs that are known, found again\n",
        f"Movements ({about}) are bent until they are optimal for weights that were drawn, and weights are "
        "learnt from them: a test of the method by itself, not of people. Cosines are between true and "
        "learnt weights of nearness alone, each times how much its cost differs among what might be done "
        "(with unsmoothness, which is always found, they would be near 1 though no nearness was); wanted "
        f"{WANTED:g}, of joints that are known. Two parts whose nearest points are always their ends, "
        "forearms and wrists for instance, have one cost under two names; *added up*: weights of costs "
        f"that are the same to {100 * SAME:g} % in all that might have been done are. "
        f"Around movements that are optimal others are drawn {1 / NEAR:.0f} times as near as around the "
        "rest, chosen by sixteen truths that are none of these. Agreement is the cosine of true and "
        "learnt costs of "
        "nearness of what might be done, beside what is done; that of equal weights says what no learning "
        "has: nearness of one part is so much like that of the next that many weights are nearly the same "
        f"cost. Not quite optimal: drawn around the optimum, {LOOSE:g} mm and {3 * LOOSE:g} mrad. As "
        "motion capture sees it: joints reckoned from four keypoints with noise, smoothed as recordings "
        "are.\n",
        f"| what moves otherwise | bent by | learnt from | cosine: median | least | {WANTED:g} or more | "
        "added up: median | agreement: median | least | of equal weights | better than those in |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for joints in SPREADS:
        own = [one for one in sought if one.joints == joints]
        bend = 100.0 * float(np.median([one.bend for one in own]))
        flat = float(np.median([one.flat for one in own]))
        for kind, words in KINDS.items():
            cosines = [one.cosines[kind] for one in own]
            agreement = [one.agreement[kind] for one in own]
            merged = np.median([one.merged[kind] for one in own])
            better = sum(one.agreement[kind] > one.flat for one in own)
            text.append(
                f"| {joints} | {bend:.1f} cm | {words} | {np.median(cosines):.3f} | {min(cosines):.3f} | "
                f"{100 * _share(cosines):.0f} % | {merged:.3f} | {np.median(agreement):.3f} | "
                f"{min(agreement):.3f} | {flat:.3f} | {better} of {len(own)} |"
            )
    head = " | ".join(f"cosine, {words}" for words in KINDS.values())
    text += [
        "",
        f"| case | movements | what moves otherwise | costs that differ | nearness that counts | {head} |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in sought:
        values = [f"{one.cosines[kind]:.3f}" for kind in KINDS]
        text.append(
            f"| {one.session.case} | {one.movements} | {one.joints} | {one.different} | "
            f"{', '.join(one.costs)} | "
            f"{' | '.join(values)} |"
        )
    return [*text, ""]
