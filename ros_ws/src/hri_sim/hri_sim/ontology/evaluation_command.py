"""Command line of ``scripts/evaluate_ontology.py``: how well the cases of interaction are told apart."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_prediction.extras import check_networkx, check_scikit_learn
from hri_prediction.ontology.classifier import COST
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology.data import SIMULATED
from hri_sim.ontology.judging import FULL_EXTENT, SMOKE_EXTENT, judge, overall_words
from hri_sim.ontology.training_command import RUNS, SMOKE_NOTE
from hri_sim.readability_report.run_folder import write_json

FILE, TEXT = "results.json", "ontology.md"
SEED = 1
"""Of the dyads that are judged: others than those that the shipped classifier has learnt."""
DOMAIN = "77"
"""ROS domain in which people are watched live, unless the environment names one."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


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
            help=f"Random halves. Default: {FULL_EXTENT.repetitions}; smoke: {SMOKE_EXTENT.repetitions}.",
            min=1,
            show_default=False,
        ),
    ] = None,
    cost: Annotated[
        float, typer.Option(help="Of what lies on the wrong side of the margin.", min=1e-3)
    ] = COST,
    live: Annotated[
        float | None,
        typer.Option(
            help="How long simulated people are watched live, by node processes [s]; 0: not. Default: "
            f"{FULL_EXTENT.live:g}; smoke: {SMOKE_EXTENT.live:g}; with --data: 0.",
            min=0.0,
            show_default=False,
        ),
    ] = None,
    workers: Workers = None,
    runs: Annotated[
        Path, typer.Option(help="Folder of what is done, which is not done again.")
    ] = RUNS,
    smoke: Annotated[
        bool,
        typer.Option(
            "--smoke",
            help="Four people, two encounters, few halves; with --data few halves alone.",
        ),
    ] = False,
) -> None:
    """Train and test on halves of the segments, on recordings and on persons left out.

    Prints what the thesis' tables 4.1 to 4.4 have, for whatever recordings it is given. Random halves have
    segments of the same recording on both sides; with recordings or persons left out, whom these people
    were with is still known. What to expect of two strangers is what the classifier that ships makes of
    simulated dyads of another seed, or of recordings that it has not learnt.

    Of simulated dyads it says besides how late the monitor tells cases, live, and how well known costs are
    found again.
    """
    console = Console()
    check_scikit_learn()
    check_networkx()
    make_folders(out=out, runs=runs)
    os.environ.setdefault("ROS_DOMAIN_ID", DOMAIN)
    origin = results_origin()
    extent = SMOKE_EXTENT if smoke else FULL_EXTENT
    if data != SIMULATED and live:
        raise ConfigError(
            f"--live {live:g} with --data {data}",
            expected="--live with simulated people",
            hint="recorded ones do not move live: scripts/replay_mocap.py plays them to the monitor",
        )
    if data != SIMULATED:  # what is of simulated people says nothing of these
        extent = replace(extent, truths=0, live=0.0)
    extent = replace(
        extent,
        repetitions=repetitions or extent.repetitions,
        live=extent.live if live is None else live,
    )
    with resumable(console, runs), ProgressLine(console) as progress:
        found = judge(data, extent, seed, cost, runs, workers or available_cores(), progress)
    results = found.results()
    write_json(out / FILE, {"origin": origin, "smoke": smoke, **results})
    head = ["# How well the cases of interaction are told apart\n", f"{origin_line(origin)}\n"]
    if smoke:
        head.append(SMOKE_NOTE)
    (out / TEXT).write_text("\n".join([*head, *found.lines(out), *found.case_lines(out)]))
    for line in (*found.refused, *overall_words(results)):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(f"tables: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="evaluate_ontology.py")
    return 0
