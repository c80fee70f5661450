"""Command line of ``scripts/evaluate_rnn.py``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_planner.rnn.model_file import find_policy, read_policy
from hri_prediction.errors import ConfigError
from hri_prediction.results.folder import check_folder
from hri_prediction.results.options import Workers, make_folders
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.policies.evaluation import evaluate
from hri_sim.policies.evaluation_picture import draw_paths
from hri_sim.policies.evaluation_report import report, table, tables
from hri_sim.policies.judging import SIMULATED, data_for
from hri_sim.policies.likeness_table import likeness_table
from hri_sim.policies.partners import beside_partners

PARTNER_ENCOUNTERS = 20
SMOKE_TESTS, SMOKE_PARTNERS = 16, 1
_RESULTS, _REPORT = "results.json", "results.md"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class Item:
    """A policy to be evaluated.

    Attributes:
        name: What results call it.
        path: Of its file.
    """

    name: str
    path: Path


def named(models: Sequence[str]) -> list[Item]:
    """Policies by names that differ.

    Raises:
        ConfigError: when one is named twice, or none ships by a name.
    """
    paths = [find_policy(model) for model in models]
    if len({path.resolve() for path in paths}) < len(paths):
        raise ConfigError("--model names a policy twice", expected="each once")
    stems = [path.stem for path in paths]
    names = [
        stem if stems.count(stem) == 1 else f"{path.resolve().parent.name}/{stem}"
        for path, stem in zip(paths, stems, strict=True)
    ]
    if len(set(names)) < len(names):
        names = [str(path) for path in paths]
    return [Item(name, path) for name, path in zip(names, paths, strict=True)]


def evaluate_one(
    item: Item, data: str, seed: int, out: Path, smoke: bool
) -> tuple[str, dict[str, Any]]:
    """Its name and all of its figures; draws its picture, too."""
    model, trained = read_policy(item.path)
    found = data_for(data, trained, seed)
    test = found.test[:: max(len(found.test) // SMOKE_TESTS, 1)] if smoke else found.test
    picture = f"paths_{item.name.replace('/', '_').lstrip('_')}.png"
    draw_paths(out / picture, item.name, model, test)
    beside = {}
    if found.simulated:
        beside = beside_partners(model, seed, SMOKE_PARTNERS if smoke else PARTNER_ENCOUNTERS)
    return item.name, {
        "file": str(item.path),
        "data": found.name,
        "left_out": found.left_out,
        **evaluate(model, test, np.random.default_rng(seed)),
        "dtw": likeness_table(model, found.learnt, test, np.random.default_rng(seed)),
        "promp_learnt_from": "what policies learn from" if found.apart else "the test, too",
        "partners": beside,
        "picture": picture,
    }


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def evaluate_rnn(
    model: Annotated[
        list[str],
        typer.Option(help="A policy's file, or the name of one that ships; may be repeated."),
    ],
    out: Annotated[
        Path, typer.Option(help=f"Folder for {_RESULTS}, {_REPORT} and paths_NAME.png.")
    ],
    data: Annotated[
        str,
        typer.Option(
            help="simulated: the set that the policy learnt from, its unseen setups drawn anew; or a "
            "set's name (D1, D2, D3-1, D3-2, D3-3); or a file of recordings."
        ),
    ] = SIMULATED,
    seed: Annotated[
        int, typer.Option(help="Of setups, people and noise that are drawn.", min=0)
    ] = 0,
    workers: Workers = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace results that are in --out.")
    ] = False,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="A few encounters only (seconds).")
    ] = False,
) -> None:
    """Hold policies against the people they learnt from, and against others.

    The columns of table 5.2 (without and with noise), dynamic time warping beside ProMPs and people,
    and for simulated people partners who give way otherwise than those learnt from.
    """
    console = Console()
    items = named(model)
    for item in items:
        read_policy(item.path)
    check_folder(out, [_RESULTS, _REPORT], overwrite)
    make_folders(out=out)
    origin = results_origin()
    work = partial(evaluate_one, data=data, seed=seed, out=out, smoke=smoke)
    done: dict[str, dict[str, Any]] = {}
    with ProgressLine(console) as progress:
        progress.say(f"{len(items)} policies" if len(items) > 1 else items[0].name)
        if len(items) == 1:
            done.update([work(items[0])])
        else:
            for count, found in enumerate(
                do_all(work, items, workers=workers or available_cores()), 1
            ):
                done.update([found])
                progress.count(count, len(items))
    configs = {item.name: done[item.name] for item in items}
    results = {
        "origin": origin,
        "data": data,
        "seed": seed,
        "smoke": smoke,
        "configs": configs,
        "dtw": configs[items[0].name]["dtw"],
    }
    (out / _RESULTS).write_text(json.dumps(results, allow_nan=False, indent=1) + "\n")
    (out / _REPORT).write_text(report(results))
    for title, head, rows in tables(results):
        console.print(table(title, head, rows), highlight=False)
        console.print()
    console.print(f"results: {out / _RESULTS}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="evaluate_rnn.py")
    return 0
