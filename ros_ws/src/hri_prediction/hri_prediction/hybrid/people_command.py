"""Command line of ``scripts/people.py``: people that were learnt, listed, renamed, forgotten."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.hybrid.store import PeopleStore
from hri_prediction.hybrid.weight_process import to_alpha
from hri_prediction.results.options import run_app

DEFAULT_FOLDER = Path("runs/people")

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
Folder = Annotated[Path, typer.Option(help="Folder in which people are kept.")]


@app.callback()
def people() -> None:
    """People that the hybrid predictor has learnt: what is known of whom, and how to forget them."""


@app.command("list")
def list_people(folder: Folder = DEFAULT_FOLDER) -> None:
    """List people, what was seen of them, and when last."""
    store = PeopleStore(folder)
    found = store.people()
    if not found:
        print(f"{folder} knows nobody")
        return
    table = Table("person", "reaches", "tasks", "paths explained", "last change")
    for person in found:
        if person.problem:
            table.add_row(person.name, "–", "–", "–", f"damaged: {person.problem}")
            continue
        reaches = str(sum(person.reaches.values()))
        table.add_row(
            person.name, reaches, str(len(person.reaches)), str(person.weights), person.changed
        )
    Console().print(table)


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="Of a person.")], folder: Folder = DEFAULT_FOLDER
) -> None:
    """Show the reaches of each task that were seen of a person, and which weights of costs explain them."""
    store = PeopleStore(folder)
    store.folder_of(name)
    tasks, own = store.load(name)
    table = Table("task", "arm", "reaches", escape("duration [s]"), "KL a weight")
    for task in tasks:
        durations = task.durations_s
        mean = f"{durations.mean():.2f}" if len(durations) else "–"
        last = f"{task.divergences[-1]:.4f}" if task.divergences else "–"
        table.add_row(task.key.name, task.key.side, str(task.seen), mean, last)
    Console().print(table)
    explained = len(own) if own is not None else 0
    print(f"mean paths explained: {explained}")
    if own is None:
        return
    weights = Table("explained", *own.names)
    for name, alpha in zip(own.reaches, to_alpha(own.logs, own.names), strict=True):
        what = name.removesuffix(".npz") or "not known which"
        weights.add_row(what, *(f"{share:.2f}" for share in alpha))
    Console().print(weights)


@app.command()
def move(
    name: Annotated[str, typer.Argument(help="Of a person.")],
    new: Annotated[str, typer.Argument(help="Another name, that is free.")],
    folder: Folder = DEFAULT_FOLDER,
) -> None:
    """Give a person another name."""
    print(f"{PeopleStore(folder).move(name, new)}")


@app.command()
def delete(
    name: Annotated[str, typer.Argument(help="Of a person.")],
    folder: Folder = DEFAULT_FOLDER,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
) -> None:
    """Forget a person: all that is kept of them is deleted."""
    store = PeopleStore(folder)
    where = store.folder_of(name)
    if not yes and not typer.confirm(f"delete {where} and all that is in it?"):
        raise typer.Exit(1)
    store.delete(name)
    print(f"{where} is deleted")


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``people`` with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "people.py", argv)
