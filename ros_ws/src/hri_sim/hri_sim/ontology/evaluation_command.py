"""Command line of ``scripts/evaluate_ontology.py``: how well the cases of interaction are told apart."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_prediction.extras import check_scikit_learn
from hri_prediction.ontology.cases import REDUCED, cases
from hri_prediction.ontology.classifier import COST
from hri_prediction.ontology.evaluation import FULL, KINDS
from hri_prediction.ontology.graph import all_sets, classes, feasible_sets
from hri_prediction.ontology.picture import draw_cases
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology import figures
from hri_sim.ontology.cosine import cosine_lines, seek_all
from hri_sim.ontology.data import SIMULATED, table_of_data
from hri_sim.ontology.pictures import draw_confusions, draw_layouts
from hri_sim.ontology.report import case_list, evaluation_lines
from hri_sim.ontology.sessions import DyadStudy, layout_of
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT, do_splits, splits_of
from hri_sim.ontology.training_command import RUNS, SMOKE
from hri_sim.readability_report.run_folder import write_json

FILE, TEXT, CASES, LAYOUTS = "results.json", "ontology.md", "cases.png", "layouts.png"
REPETITIONS, SMOKE_REPETITIONS = 100, 2
TRUTHS, SMOKE_TRUTHS = 20, 1
SEED = 1
"""Of the dyads that are judged: others than those that the shipped classifier has learnt."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


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


def draw(told: figures.Told, folder: Path) -> dict[str, str]:
    """Draw the confusion matrices; names of the files by what they are of."""
    orders = {FULL: [n for group in REDUCED for n in group], KINDS[1]: list(range(1, 8))}
    titles = {RANDOM: "random halves", SESSIONS: "recordings left out", SUBJECT: "persons left out"}
    found = {}
    for labels, own in figures.matrices(told).items():
        known = [n for n in orders[labels] if n in next(iter(own.values())).classes]
        found[labels] = f"confusion_{labels}.png"
        shown = {titles[kind]: one for kind, one in own.items()}
        draw_confusions(folder / found[labels], shown, known)
    return found


def evaluate(
    table: SegmentTable,
    repetitions: int,
    seed: int,
    cost: float,
    runs: Path,
    workers: int,
    progress: ProgressLine,
) -> figures.Told:
    """All splits of a table."""
    progress.say("splits")
    return do_splits(
        table, splits_of(table, repetitions, seed, cost), runs, workers, progress.count
    )


def _text(origin: Mapping[str, Any], what: str, lines: list[str]) -> str:
    head = [
        "# How well the cases of interaction are told apart\n",
        f"{origin_line(dict(origin))}\n",
        what + "\n",
    ]
    return "\n".join([*head, *lines])


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def evaluate_ontology(
    out: Annotated[Path, typer.Option(help=f"Folder for {FILE}, {TEXT} and pictures.")],
    data: Annotated[
        str,
        typer.Option(
            help="simulated; or a table of segments (.npz); or a list of recordings, sessions.yaml or the "
            "folder it is in."
        ),
    ] = SIMULATED,
    seed: Annotated[int, typer.Option(help="Of simulated dyads, and of the splits.", min=0)] = SEED,
    repetitions: Annotated[
        int | None,
        typer.Option(
            help=f"Random halves. Default: {REPETITIONS}; smoke: {SMOKE_REPETITIONS}.",
            min=1,
            show_default=False,
        ),
    ] = None,
    cost: Annotated[
        float, typer.Option(help="Of what lies on the wrong side of the margin.", min=1e-3)
    ] = COST,
    workers: Workers = None,
    runs: Annotated[
        Path, typer.Option(help="Folder of what is done, which is not done again.")
    ] = RUNS,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two people, three encounters, few halves.")
    ] = False,
) -> None:
    """Train and test on halves of the segments, on recordings and on persons left out.

    Prints what the thesis' tables 4.1 to 4.4 have, for whatever recordings it is given. Random halves have
    segments of the same recording on both sides: those with recordings or persons left out say what to
    expect of others.
    """
    console = Console()
    check_scikit_learn()
    make_folders(out=out, runs=runs)
    origin, study = results_origin(), SMOKE if smoke else DyadStudy()
    cores = workers or available_cores()
    with resumable(console, runs), ProgressLine(console) as progress:
        progress.say("recordings")
        table = table_of_data(data, study, seed, runs, cores, progress.count)
        number = repetitions or (SMOKE_REPETITIONS if smoke else REPETITIONS)
        told = evaluate(table, number, seed, cost, runs, cores, progress)
        progress.say("costs that are known, sought")
        sought = seek_all(study, SMOKE_TRUTHS if smoke else TRUTHS, seed, cores, progress.count)
    where = f"simulated dyads, seed {seed}" if data == SIMULATED else Path(data).name
    cosines = [one.cosine for one in sought]
    found = {
        "counts": counts(),
        **figures.results(told),
        "piirl_cosine": round(float(np.median(cosines)), 4),
        "piirl_cosine_least": round(min(cosines), 4),
    }
    write_json(out / FILE, {"origin": origin, "data": where, **found})
    lines = evaluation_lines(told, draw(told, out))
    draw_cases(out / CASES)
    lines += cosine_lines(sought)
    lines += ["## The cases\n", *case_list(), f"![The cases as graphs]({CASES})\n"]
    if data == SIMULATED:
        layouts = {f"case {one.number}": layout_of(one.number, "frontal") for one in cases()}
        draw_layouts(out / LAYOUTS, layouts)
        lines.append(f"![The cases as they are simulated]({LAYOUTS})\n")
    (out / TEXT).write_text(_text(origin, about(table, where), lines))
    for labels in KINDS:
        own = found[labels]
        words = ", ".join(
            f"{name.replace('_', ' ')} {100 * own[name]:.1f} %"
            for name in ("random", "by_session", "by_subject")
            if own[name] is not None
        )
        console.print(f"{labels} ontology: {words}", highlight=False)
    console.print(f"tables: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="evaluate_ontology.py")
    return 0
