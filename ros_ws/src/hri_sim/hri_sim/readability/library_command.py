"""Command line of ``scripts/policy_library.py``: policies that were learnt with people, side by side."""

from __future__ import annotations

import json
import shutil
from itertools import groupby
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_planner.dmp.frames import way_frame
from hri_planner.dmp.model_file import read_dmp
from hri_planner.pibb.comparison import Comparison
from hri_planner.pibb.library import Entry, PolicyLibrary
from hri_prediction.errors import ConfigError
from hri_prediction.files.whole import write_whole
from hri_prediction.results.folder import check_folder
from hri_prediction.results.options import make_folders
from hri_prediction.results.origin import origin_line, results_origin
from hri_sim.benchmark.report import markdown_table
from hri_sim.media.look import BLUE, GREEN, GREY, PURPLE, SKY, VERMILION
from hri_sim.policies.evaluation_report import number, table
from hri_sim.reproduction.drawing import drawn

DEFAULT_LIBRARY = Path("runs/policies")
MARK_S = 0.25
"""Time between the dots on ways [s]."""

_RESULTS, _REPORT, _PICTURE = "compare.json", "compare.md", "compare.png"
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, GREY)
_LINES = ("-", "--", ":")
_VIEWS = (("from above", "left [cm]", 1), ("from the side", "up [cm]", 2))

CONTEXT = {"help_option_names": ["-h", "--help"]}
app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings=CONTEXT,
    no_args_is_help=True,
    help="Policies that were learnt with people: list, compare, add and export them.",
)

Library = Annotated[
    Path | None,
    typer.Option(
        help=f"Folder of the library. Default: {DEFAULT_LIBRARY} below the present folder.",
        show_default=False,
    ),
]
ExperimentName = Annotated[str, typer.Argument(help="Experiment that policies were learnt in.")]
Replace = Annotated[bool, typer.Option("--replace", help="Replace the file that is there.")]


@app.command("list", context_settings=CONTEXT)
def list_policies(library: Library = None) -> None:
    """List the policies of the library, and what was learnt in how many trials."""
    folder = _folder(library)
    entries = PolicyLibrary(folder).entries()
    if not entries:
        _say(f"no policies in {folder}; policy_library.py add FILE --person NAME adds one")
        return
    head = ["person", "goals", "updates", "trials", "cost first", "last", "saved", "commit"]
    usable = [entry for entry in entries if not entry.problem]
    for name, own in groupby(usable, lambda entry: entry.experiment):
        rows = [_entry_row(entry) for entry in own]
        Console().print(table(f"{name} in {folder}", head, rows), highlight=False)
        _say("")
    for entry in entries:
        if entry.problem:
            _say(f"cannot be used: {entry.file}: {entry.problem.removeprefix(f'{entry.file}: ')}")


@app.command(context_settings=CONTEXT)
def compare(
    experiment: ExperimentName,
    persons: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[PERSON]...", help="Whose policies. Default: all.", show_default=False
        ),
    ] = None,
    library: Library = None,
    out: Annotated[
        Path | None,
        typer.Option(help=f"Folder for {_RESULTS}, {_REPORT} and {_PICTURE}.", show_default=False),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace results that are in --out.")
    ] = False,
) -> None:
    """Compare the ways of several people's policies to each goal.

    How far the ways of two policies are apart at the same shares of their motions; how long each way
    is, how far it goes to a side of the straight line, and how like it is to the policy's other ways
    (J_delta: small is distinct).
    """
    if out is not None:
        check_folder(out, [_RESULTS, _REPORT, _PICTURE], overwrite)
    found = PolicyLibrary(_folder(library)).compare(experiment, persons or ())
    console = Console()
    for title, head, rows in tables(found):
        console.print(table(title, head, rows), highlight=False)
        console.print()
    if out is None:
        return
    make_folders(out=out)
    results = {"origin": results_origin(), **found.to_mapping()}
    write_whole(
        {
            out / _PICTURE: lambda path: draw_comparison(path, found),
            out / _REPORT: lambda path: _write(path, report(found, results["origin"])),
            out / _RESULTS: lambda path: _write(
                path, json.dumps(results, allow_nan=False, indent=1) + "\n"
            ),
        }
    )
    _say(f"results: {out / _RESULTS}")


@app.command(context_settings=CONTEXT)
def add(
    file: Annotated[
        Path, typer.Argument(help="A policy.npz, as an adaptation leaves it in its folder.")
    ],
    person: Annotated[str, typer.Option(help="With whom it was learnt.")],
    experiment: Annotated[
        str | None,
        typer.Option(
            help="Experiment that it was learnt in. Default: what the file says.",
            show_default=False,
        ),
    ] = None,
    library: Library = None,
    replace: Replace = False,
) -> None:
    """Add a policy to the library."""
    policy, learnt = read_dmp(file)
    known = learnt.get("experiment")
    name = experiment or known
    if not isinstance(name, str):
        raise ConfigError(
            f"{file} does not say in which experiment it was learnt", hint="add --experiment NAME"
        )
    # A library need not be there before the first policy is.
    shelf = PolicyLibrary(library or DEFAULT_LIBRARY)
    _say(f"added: {shelf.add(policy, person, name, learnt, replace=replace)}")
    if known not in (None, name):
        _say(f"note: {file} says that it was learnt in {known}, not in {name}")


@app.command(context_settings=CONTEXT)
def export(
    experiment: ExperimentName,
    person: Annotated[str, typer.Argument(help="Whose policy.")],
    file: Annotated[Path, typer.Argument(help="Where to: a file that ends in .npz.")],
    library: Library = None,
    replace: Replace = False,
) -> None:
    """Copy a policy out of the library into a file."""
    if file.suffix != ".npz":
        raise ConfigError(f"file {file}", expected="a name that ends in .npz")
    if file.exists() and not replace:
        raise ConfigError(f"{file} is there already", hint="choose another name or add --replace")
    shelf = PolicyLibrary(_folder(library))
    source = shelf.file_of(experiment, person)
    read_dmp(source)
    write_whole({file: lambda path: shutil.copyfile(source, path)})
    _say(f"exported: {file}")


def tables(found: Comparison) -> list[tuple[str, list[str], list[list[str]]]]:
    """Titles, heads and rows of a comparison; distances in cm, J_delta in 1/m."""
    ways = [
        [
            way.goal,
            way.person,
            number(1e2 * way.length, 4),
            number(1e2 * way.straight, 4),
            number(1e2 * way.sideways),
            way.side,
            number(way.indistinct),
        ]
        for goal in found.goals
        for way in found.ways
        if way.goal == goal
    ]
    pairs = [
        [
            pair.goal,
            f"{pair.first} – {pair.second}",
            *(number(1e2 * v) for v in (pair.rms, pair.largest, pair.start_apart, pair.goal_apart)),
        ]
        for pair in found.pairs
    ]
    parts = [
        (
            f"{found.experiment}: each way beside the straight line",
            [
                "goal",
                "person",
                "length [cm]",
                "straight [cm]",
                "sideways [cm]",
                "to the",
                "J_delta [1/m]",
            ],
            ways,
        ),
        (
            f"{found.experiment}: how far the ways of two people are apart",
            ["goal", "persons", "rms [cm]", "largest [cm]", "starts [cm]", "goals [cm]"],
            pairs,
        ),
    ]
    return [part for part in parts if part[2]]


def report(found: Comparison, origin: dict[str, Any]) -> str:
    """The same in Markdown, with the picture."""
    parts = [f"# Policies of {found.experiment}, compared\n", origin_line(origin) + "\n"]
    for title, head, rows in tables(found):
        cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
        parts += [f"## {title}\n", markdown_table(head, cells)]
    parts.append(f"![ways of {', '.join(found.persons)}]({_PICTURE})\n")
    return "\n".join(parts)


def draw_comparison(path: Path, found: Comparison) -> None:
    """The ways of all persons to each goal, from above and from the side of the first one's way."""
    columns = len(found.goals)
    with drawn(path, max(3.0 * columns, 6.0) + 0.4, 5.6) as figure:
        panels = figure.subplots(len(_VIEWS), columns, squeeze=False, sharex="col", sharey="row")
        lines: dict[str, Any] = {}
        for column, goal in enumerate(found.goals):
            known = {name: own for name, own in found.policies.items() if goal in own.goals}
            first = next(iter(known.values()))
            frame = way_frame(first.start, first.goals[goal])
            for row, (view, label, axis) in enumerate(_VIEWS):
                axes = panels[row, column]
                axes.axhline(0.0, color="0.75", lw=0.8)
                for name, policy in known.items():
                    index = found.persons.index(name)
                    style = _LINES[index // len(_COLOURS) % len(_LINES)]
                    points = 1e2 * (policy.path(goal) - first.start) @ frame
                    stride = max(round(MARK_S / float(np.diff(policy.response().times[:2])[0])), 1)
                    colour = _COLOURS[index % len(_COLOURS)]
                    (lines[name],) = axes.plot(
                        points[:, 0], points[:, axis], style, color=colour, lw=1.6, label=name
                    )
                    marked = points[::stride]
                    axes.plot(marked[:, 0], marked[:, axis], "o", color=colour, ms=3.0, mew=0.0)
                    axes.plot(*points[-1, [0, axis]], "o", ms=9, mfc="none", mec=colour, mew=1.2)
                axes.set_title(f"{goal}, {view}")
                axes.tick_params(labelbottom=True, labelleft=True)
                axes.set_xlabel("along the straight line [cm]")
                axes.set_ylabel(label)
        handles = [lines[name] for name in found.persons]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
        figure.suptitle(
            f"{found.experiment}: start at 0, rings: goals, a dot every {MARK_S:g} s; "
            "sideways on a scale of its own",
            x=0.01, ha="left", fontsize=9,
        )  # fmt: skip


def _folder(library: Path | None) -> Path:
    """The library's folder; one that is named must be there."""
    if library is not None and not library.is_dir():
        raise ConfigError(f"--library {library} is no folder", expected="the folder of a library")
    return library or DEFAULT_LIBRARY


def _entry_row(entry: Entry) -> list[str]:
    count = ["–" if value is None else str(value) for value in (entry.updates, entry.trials)]
    costs = [number(value) for value in (entry.cost_first, entry.cost_last)]
    saved = entry.saved[:16].replace("T", " ") or "–"
    goals = ", ".join(entry.goals)
    return [entry.person, goals, *count, *costs, saved, entry.commit or "–"]


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _say(text: str) -> None:
    Console().print(text, highlight=False, soft_wrap=True, markup=False)


def main() -> int:
    """Entry point."""
    app(prog_name="policy_library.py")
    return 0
