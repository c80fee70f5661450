"""How well the cases of interaction are told apart: what an evaluation measures, and its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hri_prediction.ontology.cases import REDUCED, cases
from hri_prediction.ontology.evaluation import FULL, KINDS
from hri_prediction.ontology.graph import all_sets, classes, feasible_sets
from hri_prediction.ontology.picture import draw_cases
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology import figures
from hri_sim.ontology.cosine import Found, cosine_lines, cosine_results, seek_all
from hri_sim.ontology.data import SIMULATED, segments_of_data
from hri_sim.ontology.live import live_lines
from hri_sim.ontology.pictures import draw_confusions, draw_layouts
from hri_sim.ontology.report import case_list, evaluation_lines
from hri_sim.ontology.sessions import DyadStudy, layout_of
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT, do_splits, splits_of
from hri_sim.ontology.strangers import Shipped, judge_shipped
from hri_sim.ontology.training_command import SEED as LEARNT_SEED
from hri_sim.ontology.training_command import SMOKE

CASES, LAYOUTS = "cases.png", "layouts.png"
LIVE_CASES = (1, 2, 3, 13, 17, 19)
"""What two people do who are watched live."""


@dataclass(frozen=True)
class Extent:
    """How much is done.

    Attributes:
        study: Of simulated dyads.
        repetitions: Random halves.
        truths: Known costs that are sought; 0: none.
        live: How long people are watched live [s]; 0: not at all.
        live_cases: What they do, one pair after the other.
    """

    study: DyadStudy
    repetitions: int
    truths: int
    live: float
    live_cases: tuple[int, ...] = LIVE_CASES


FULL_EXTENT = Extent(DyadStudy(), 100, 20, 120.0)
SMOKE_EXTENT = Extent(SMOKE, 2, 1, 12.0, (1, 13))


@dataclass(frozen=True, eq=False)
class Judged:
    """What an evaluation came to.

    Attributes:
        where: What the segments are of.
        simulated: Whether of simulated dyads.
        table: The segments.
        told: What came of the splits.
        sought: Known costs that were sought.
        live: How late cases are told; of no times when none was told, none when that was not measured.
        live_cases: What the pairs did who were watched.
        shipped: What the classifier that ships makes of them; none where it has learnt them.
        options: What else was asked for.
        refused: Of each recording of which movements were refused, how many and why, a line each.
    """

    where: str
    simulated: bool
    table: SegmentTable
    told: figures.Told
    sought: Sequence[Found]
    live: dict[str, float | int] | None
    live_cases: tuple[int, ...]
    shipped: Shipped | None
    options: dict[str, Any]
    refused: tuple[str, ...]

    def results(self) -> dict[str, Any]:
        """As in ``results.json``."""
        return {
            "data": self.where,
            "options": self.options,
            "refused": list(self.refused),
            "counts": counts(),
            **figures.results(self.told),
            "shipped": None if self.shipped is None else self.shipped.to_mapping(),
            "live_latency_ms": self.live,
            **cosine_results(self.sought),
        }

    def lines(self, folder: Path, prefix: str = "") -> list[str]:
        """The report on how well cases are told apart; its pictures are drawn.

        Args:
            folder: For pictures.
            prefix: Before their names in the report.
        """
        pictures = {labels: prefix + file for labels, file in draw(self.told, folder).items()}
        asked = ", ".join(f"{name} {value}" for name, value in self.options.items())
        text = [
            f"{about(self.table, self.where)} Asked for: {asked}.\n",
            *refused_lines(self.refused),
        ]
        text += evaluation_lines(self.told, pictures)
        if self.shipped is not None:
            text += self.shipped.lines(strangers=self.simulated)
        if self.live is not None:
            text += live_lines(self.live, self.live_cases)
        return text + (cosine_lines(self.sought, self.where) if self.sought else [])

    def case_lines(self, folder: Path, prefix: str = "") -> list[str]:
        """The report on the cases themselves; arguments as :meth:`lines`."""
        draw_cases(folder / CASES)
        text = ["## The cases\n", *case_list(), f"![The cases as graphs]({prefix}{CASES})\n"]
        if self.simulated:
            layouts = {f"case {one.number}": layout_of(one.number, "frontal") for one in cases()}
            draw_layouts(folder / LAYOUTS, layouts)
            text.append(f"![The cases as they are simulated]({prefix}{LAYOUTS})\n")
        return text


def counts() -> list[int]:
    """Sets of edges, those that can be, cases, and classes of the reduced ontology."""
    return [len(all_sets()), len(feasible_sets()), len(classes()), len(REDUCED)]


def about(table: SegmentTable, where: str) -> str:
    """What the segments are of."""
    sessions = len(set(table.session.tolist()))
    return (
        f"{len(table):,} segments of {sessions} recordings of {len(table.subjects)} people, {where}; "
        f"{len(set(table.case.tolist()))} of {len(cases())} cases."
    )


def refused_lines(refused: Sequence[str]) -> list[str]:
    """Which movements of recordings are in no figure, and why."""
    return [*(f"- {line}" for line in refused), ""] if refused else []


def draw(told: figures.Told, folder: Path) -> dict[str, str]:
    """Draw the confusion matrices; names of the files by what they are of."""
    orders = {FULL: [n for group in REDUCED for n in group], KINDS[1]: list(range(1, 8))}
    titles = {RANDOM: "random halves", SESSIONS: "recordings left out", SUBJECT: "persons left out"}
    found = {}
    for labels, own in figures.matrices(told).items():
        if labels not in orders:
            continue
        known = [n for n in orders[labels] if n in next(iter(own.values())).classes]
        found[labels] = f"confusion_{labels}.png"
        shown = {titles[kind]: one for kind, one in own.items()}
        draw_confusions(folder / found[labels], shown, known)
    return found


def judge(
    data: str,
    extent: Extent,
    seed: int,
    cost: float,
    runs: Path,
    workers: int,
    progress: ProgressLine,
) -> Judged:
    """Do everything.

    Args:
        data: As ``--data``.
        extent: How much.
        seed: Of simulated dyads, and of the splits.
        cost: Of the machine.
        runs: Folder of what is done, which is not done again.
        workers: Processes.
        progress: Told what is under way.
    """
    progress.say("recordings")
    segments = segments_of_data(data, extent.study, seed, runs, workers, progress.count)
    table = segments.table
    progress.say("splits")
    told = do_splits(
        table, splits_of(table, extent.repetitions, seed, cost), runs, workers, progress.count
    )
    sought: list[Found] = []
    if extent.truths:
        progress.say("costs that are known, sought")
        sought = seek_all(extent.study, extent.truths, seed, runs, workers, progress.count)
    live: dict[str, float | int] | None = None
    if extent.live > 0.0:
        # Here, as everything else needs no ROS.
        from hri_sim.launch.watch_cases import measure_live

        progress.say(f"watching people live, {extent.live:g} s")
        seconds = extent.live / len(extent.live_cases)
        live = measure_live(runs / "live", extent.live_cases, seed, seconds)
    simulated = data == SIMULATED
    where = f"simulated dyads, seed {seed}" if simulated else Path(data).name
    learnt = simulated and seed == LEARNT_SEED
    shipped = None if learnt else judge_shipped(table)
    options = {"random halves": extent.repetitions, "cost": cost}
    return Judged(
        where,
        simulated,
        table,
        told,
        sought,
        live,
        extent.live_cases,
        shipped,
        options,
        segments.refused,
    )


def overall_words(found: dict[str, Any]) -> list[str]:
    """The overall rates, a line for each kind of labels."""
    return [
        f"{labels} ontology: "
        + ", ".join(
            f"{name.replace('_', ' ')} {100 * found[labels][name]:.1f} %"
            for name in ("random", "by_session", "by_subject")
            if found[labels][name] is not None
        )
        for labels in KINDS
    ]
