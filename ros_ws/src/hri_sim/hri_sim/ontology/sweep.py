"""How hard cases are to tell apart, by how much places differ from session to session."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from hri_prediction.ontology.evaluation import KINDS
from hri_sim.ontology import figures
from hri_sim.ontology.data import simulated_table
from hri_sim.ontology.layouts import measured_edges
from hri_sim.ontology.sessions import DyadStudy, Session, layout_of, places_of, sessions_of
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT, Split, do_splits

JITTERS_M = (0.0, 0.02, 0.04, 0.06, 0.08)
SPLITS = (RANDOM, SESSIONS, SUBJECT)
NAMES = {
    RANDOM: "random halves", SESSIONS: "recordings left out", SUBJECT: "persons left out",
}  # fmt: skip


@dataclass(frozen=True)
class Swept:
    """Rates at one jitter, from 0 to 1, by split and kind of labels.

    Attributes:
        jitter: Of an action space's place [m].
        rates: By the labels and the kind of split; none where sessions are too few for it.
        kept: Of sessions, whose places still have the edges of their case, no more and no fewer.
        other: Of those whose places have those of another one.
        by_case: Of the sessions of each case, by its number, those that still have its edges.
    """

    jitter: float
    rates: Mapping[tuple[str, str], float | None]
    kept: float
    other: float
    by_case: Mapping[int, float]


def edges_kept(
    sessions: Sequence[Session], study: DyadStudy
) -> tuple[float, float, dict[int, float]]:
    """Shares of sessions that have, as places are, the edges of their case, and those of another one.

    In what is left an edge is neither there nor not. Last, of those of each case, the share that has its
    edges.
    """
    found = []
    for session in sessions:
        meant = measured_edges(layout_of(session.case, session.position))
        edges = measured_edges(places_of(session, study)[0])
        found.append((edges == meant, edges is not None and edges != meant))
    shares = np.array(found, dtype=float)
    case = np.array([session.case for session in sessions])
    by_case = {int(number): float(shares[case == number, 0].mean()) for number in np.unique(case)}
    kept, other = shares.mean(axis=0)
    return float(kept), float(other), by_case


def sweep(
    study: DyadStudy,
    jitters: Sequence[float],
    repetitions: int,
    seed: int,
    cost: float,
    runs: Path,
    workers: int,
    progress: Callable[[str], Callable[[int, int], None]],
) -> list[Swept]:
    """Rates at several jitters.

    Args:
        study: All else.
        jitters: Of an action space's place [m].
        repetitions: Of random halves, and of recordings left out.
        seed: Of sessions and splits.
        cost: Of the machine.
        runs: Folder of what is kept.
        workers: Processes.
        progress: Given what is done, tells how much of it.
    """
    found = []
    for jitter in jitters:
        own = replace(study, layout_jitter=jitter)
        label = f"jitter {100 * jitter:g} cm"
        sessions = sessions_of(own, seed)
        table = simulated_table(sessions, own, runs, workers, progress(f"{label}: dyads"))
        splits = [
            Split(kind, labels, "", seed + number, cost)
            for number in range(repetitions)
            for kind in (RANDOM, SESSIONS)
            for labels in KINDS
        ]
        splits += [
            Split(SUBJECT, labels, who, seed, cost) for who in table.subjects for labels in KINDS
        ]
        told = do_splits(table, splits, runs, workers, progress(f"{label}: splits"))
        shown = figures.matrices(told)
        rates = {
            (labels, kind): shown[labels][kind].overall if kind in shown.get(labels, {}) else None
            for labels in KINDS
            for kind in SPLITS
        }
        found.append(Swept(jitter, rates, *edges_kept(sessions, own)))
    return found


def sweep_lines(swept: Sequence[Swept]) -> list[str]:
    """The part of a report that says what the jitter does."""
    text = [
        "### How much places differ\n",
        "Cases are what two people were told to do. As places, seats and detours differ, sessions may have "
        "no longer the edges of their case, or those of another one, by the distances that layouts are "
        "made by; in the rest an edge is neither there nor not.\n",
        "| jitter of places | " + " | ".join(
            f"{'20 cases' if labels == KINDS[0] else '7 classes'}, {NAMES[kind]}"
            for labels in KINDS for kind in SPLITS
        ) + " | sessions with the edges of their case | of another one |",
        "| --- |" + " --- |" * (len(KINDS) * len(SPLITS) + 2),
    ]  # fmt: skip
    for one in swept:
        found = [one.rates[labels, kind] for labels in KINDS for kind in SPLITS]
        cells = ["–" if rate is None else f"{100 * rate:.1f} %" for rate in found]
        cells += [f"{100 * share:.0f} %" for share in (one.kept, one.other)]
        text.append(f"| {100 * one.jitter:g} cm | {' | '.join(cells)} |")
    usual = next((one for one in swept if one.jitter == DyadStudy().layout_jitter), None)
    if usual is not None:
        shares = ", ".join(f"{case}: {100 * share:.0f} %" for case, share in usual.by_case.items())
        text += [
            "",
            f"With {100 * usual.jitter:g} cm, as everywhere else in this report, sessions with the edges "
            f"of their case, case by case: {shares}.",
        ]
    return [*text, ""]


def draw_sweep(path: Path, swept: Sequence[Swept]) -> None:
    """Rates by jitter."""
    figure, both = plt.subplots(1, 2, figsize=(8.5, 3.4), sharey=True, layout="constrained")
    jitters = 100.0 * np.array([one.jitter for one in swept])
    for axes, labels in zip(both, KINDS, strict=True):
        for kind in SPLITS:
            found = [one.rates[labels, kind] for one in swept]
            rates = [np.nan if rate is None else 100.0 * rate for rate in found]
            axes.plot(jitters, rates, marker="o", label=NAMES[kind])
        axes.set_title("20 cases" if labels == KINDS[0] else "7 classes", size=9)
        axes.set_xlabel("standard deviation of places between sessions [cm]")
        axes.grid(alpha=0.3)
    both[0].set_ylabel("recognised [%]")
    both[0].set_ylim(0.0, 100.0)
    both[0].legend(fontsize=7)
    figure.savefig(path, dpi=110)
    plt.close(figure)
