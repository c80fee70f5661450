"""Command line of ``scripts/train_ontology.py``: the classifier of the interaction monitor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.extras import check_scikit_learn
from hri_prediction.files.whole import write_whole
from hri_prediction.ontology.classifier import COST, InteractionClassifier, negative_log, train
from hri_prediction.ontology.evaluation import half_of
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.ontology.data import SIMULATED, segments_of_data
from hri_sim.ontology.sessions import DyadStudy
from hri_sim.readability_report.run_folder import write_json

TEXT, FIGURES = "training.md", "results.json"
RUNS = Path("runs/ontology")
SMOKE = DyadStudy(encounters=2, people=4)
"""With fewer people of no case there are two recordings, and none can be left out."""
SEED = 0
FEW = 6
"""Recordings of a case that say something of others."""
OFF = 0.2
"""By more than this probabilities that are said may not differ from what is so, on the average."""
DRAWS = 5
"""How often half of the recordings are left out."""
UNEVEN = 0.15
"""By more than this rates of these draws may not differ without a word."""
SMOKE_NOTE = "**A smoke run: its figures say that everything runs, and nothing else.**\n"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True, eq=False)
class _HalfOut:
    """What came of one draw.

    Attributes:
        what: Was left out.
        right: Whether each segment was recognised (n,).
        sure: Probability of the case it was taken for (n,).
        negative: Negative log probability of its case (n,).
        known: How many cases were learnt.
    """

    what: str
    right: NDArray[np.bool_]
    sure: NDArray[np.float64]
    negative: NDArray[np.float64]
    known: int


_EACH = ("right", "sure", "negative")


def left_out(table: SegmentTable, cost: float, rng: np.random.Generator) -> dict[str, Any]:
    """What machines that learnt half of the recordings make of the others, and how sure they are.

    Of few recordings it hangs on which are left out: that is drawn several times.

    Args:
        table: All segments.
        cost: Of the machines.
        rng: Draws the halves.
    """
    drawn = [_half_out(table, cost, rng) for _ in range(DRAWS)]
    right, sure, negative = (
        np.concatenate([getattr(one, name) for one in drawn]) for name in _EACH
    )
    rates = [float(one.right.mean()) for one in drawn]
    edges = np.linspace(0.0, 1.0, 6)
    bins = np.clip(np.digitize(sure, edges) - 1, 0, 4)
    return {
        "what": drawn[0].what,
        "draws": DRAWS,
        "recognised": float(np.mean(rates)),
        "recognised_range": [min(rates), max(rates)],
        "negative_log": float(negative.mean()),
        "chance": float(np.mean([np.log(one.known) for one in drawn])),
        "calibration": [
            {
                "sure_from": float(edges[index]),
                "sure_to": float(edges[index + 1]),
                "segments": int((bins == index).sum()),
                "sure": float(sure[bins == index].mean()) if (bins == index).any() else None,
                "right": float(right[bins == index].mean()) if (bins == index).any() else None,
            }
            for index in range(5)
        ],
    }


def _half_out(table: SegmentTable, cost: float, rng: np.random.Generator) -> _HalfOut:
    learnt = np.zeros(len(table), dtype=bool)
    for case in np.unique(table.case):
        sessions = rng.permutation(np.unique(table.session[table.case == case]))
        learnt |= np.isin(table.session, sessions[: max(len(sessions) // 2, 1)])
    what = "half of the recordings of each case left out"
    if learnt.all():  # one recording of each case
        learnt, what = half_of(table.case, rng), "half of the segments of each case left out"
    known = np.unique(table.case[learnt])
    tested = ~learnt & np.isin(table.case, known)
    model = train(
        table.features[learnt],
        table.case[learnt],
        cost=cost,
        groups=table.session[learnt],
        rng=rng,
    )
    given = model.probabilities(table.features[tested])
    right = model.classes[given.argmax(axis=1)] == table.case[tested]
    negative = negative_log(model, table.features[tested], table.case[tested])
    return _HalfOut(what, right, given.max(axis=1), negative, len(known))


def warnings(table: SegmentTable, found: dict[str, Any]) -> list[str]:
    """What whoever trusts the classifier should know first.

    Args:
        table: What it learnt.
        found: What :func:`left_out` found.
    """
    text = []
    recordings = {
        int(case): len(np.unique(table.session[table.case == case]))
        for case in np.unique(table.case)
    }
    few = [f"case {case} ({count})" for case, count in recordings.items() if count < FEW]
    if few:
        text.append(
            f"few recordings of {', '.join(few)}: {FEW} of each or more say something of others, and half "
            "of these were left out above"
        )
    rows = [row for row in found["calibration"] if row["segments"]]
    total = sum(row["segments"] for row in rows)
    said = sum(row["segments"] * row["sure"] for row in rows) / max(total, 1)
    chance = math.exp(-found["chance"])
    right = found["recognised"]
    least, most = found["recognised_range"]
    if most - least > UNEVEN:
        text.append(
            f"how much is recognised hangs on which recordings are left out: {100 * least:.0f} to "
            f"{100 * most:.0f} % in {found['draws']} draws; more recordings mend that"
        )
    if right - chance < 0.2 * (1.0 - chance):
        text.append(
            f"what was left out is recognised hardly more often than by chance ({100 * chance:.0f} %): "
            "this classifier is of no use"
        )
    elif abs(said - right) > OFF:
        text.append(
            f"probabilities are off: {100 * said:.0f} % were said on the average, {100 * right:.0f} % were "
            "so; more recordings mend that"
        )
    return text


def recognised(found: dict[str, Any] | None) -> str:
    """What became of what was left out, in a few words; empty where nothing was."""
    return f"; with {_drawn(found)} recognised" if found else ""


def _drawn(found: dict[str, Any]) -> str:
    least, most = found["recognised_range"]
    return (
        f"{found['what']}, {found['draws']} times: {100 * found['recognised']:.1f} % "
        f"({100 * least:.1f} to {100 * most:.1f} %)"
    )


def report(content: dict[str, Any]) -> str:
    """The text of ``training.md``."""
    text = [
        "# Training of the interaction classifier\n",
        f"{origin_line(content['origin'])} Data: {content['data']}.\n",
        *([SMOKE_NOTE] if content["smoke"] else []),
        f"{content['segments']:,} segments of {content['sessions']} recordings of {content['subjects']} "
        f"people, {content['cases']} cases. Support vector machine with a quadratic kernel, cost "
        f"{content['cost']:g}; slope of probabilities {content['slope']:.2f}.\n",
        *(f"- {line}" for line in content["refused"]),
        *_of_left_out(content["left_out"]),
    ]
    text += ["", *(f"**Warning**: {one}.\n" for one in content["warnings"])]
    return "\n".join(text).rstrip() + "\n"


def _of_left_out(found: dict[str, Any] | None) -> list[str]:
    if found is None:
        return []
    text = [
        f"With {_drawn(found)} recognised; negative log probability of the true case "
        f"{found['negative_log']:.2f} (knowing nothing: {found['chance']:.2f}).\n",
        "| said to be likely | segments | mean of what was said | were so |",
        "| --- | --- | --- | --- |",
    ]
    for row in found["calibration"]:
        if row["segments"]:
            text.append(
                f"| {100 * row['sure_from']:.0f} to {100 * row['sure_to']:.0f} % | {row['segments']} | "
                f"{100 * row['sure']:.0f} % | {100 * row['right']:.0f} % |"
            )
    return text


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def train_ontology(
    out: Annotated[Path, typer.Option(help=f"Folder for {SHIPPED.name}, {TEXT} and {FIGURES}.")],
    data: Annotated[
        str,
        typer.Option(
            help="simulated; or a table of segments (.npz); or a list of recordings, sessions.yaml or the "
            "folder it is in (scripts/simulate_dyads.py makes one to look at)."
        ),
    ] = SIMULATED,
    seed: Annotated[
        int, typer.Option(help="Of simulated dyads, and of what is left out.", min=0)
    ] = SEED,
    cost: Annotated[
        float, typer.Option(help="Of what lies on the wrong side of the margin.", min=1e-3)
    ] = COST,
    workers: Workers = None,
    runs: Annotated[Path, typer.Option(help="Folder in which simulated segments are kept.")] = RUNS,
    smoke: Annotated[bool, typer.Option("--smoke", help="Four people, two encounters.")] = False,
) -> None:
    """Train what tells the cases of interaction apart, and say how well it does for recordings left out.

    The interaction monitor takes the file: -p classifier:=OUT/interaction_cases.npz. The one that ships is
    made by this command as it is.
    """
    console = Console()
    check_scikit_learn()
    if smoke and data != SIMULATED:
        raise ConfigError(
            f"--smoke with --data {data}",
            expected="--smoke with simulated dyads",
            hint="leave out --smoke: all of the recordings are learnt",
        )
    make_folders(out=out, runs=runs)
    origin, study = results_origin(), SMOKE if smoke else DyadStudy()
    with resumable(console, runs if data == SIMULATED else None), ProgressLine(console) as progress:
        progress.say("recordings")
        segments = segments_of_data(
            data, study, seed, runs, workers or available_cores(), progress.count
        )
        table = segments.table
        progress.say("training")
        where = f"simulated dyads, seed {seed}" if data == SIMULATED else Path(data).name
        about = f"{len(table)} segments, {where}"
        model = train(
            table.features,
            table.case,
            cost=cost,
            groups=table.session,
            rng=np.random.default_rng(seed),
            about=about,
        )
        found: dict[str, Any] | None = None
        try:
            found = left_out(table, cost, np.random.default_rng(seed))
        except DataError as error:  # enough to learn from all, and not from half
            warned = [f"nothing was left out, so nobody knows how well it does: {error}"]
        else:
            warned = warnings(table, found)
    path = out / SHIPPED.name
    write_whole({path: model.save})
    again = InteractionClassifier.load(path)
    content = {
        "origin": origin,
        "smoke": smoke,
        "data": where,
        "segments": len(table),
        "sessions": len(np.unique(table.session)),
        "subjects": len(table.subjects),
        "cases": len(again.classes),
        "cost": cost,
        "seed": seed,
        "refused": list(segments.refused),
        "slope": again.slope,
        "left_out": found,
        "warnings": warned,
    }
    write_json(out / FIGURES, content)
    (out / TEXT).write_text(report(content))
    console.print(
        f"{path}: {len(again.classes)} cases, {len(table):,} segments{recognised(found)}",
        highlight=False,
        soft_wrap=True,
    )
    for one in segments.refused:
        console.print(one, highlight=False, soft_wrap=True)
    for one in warned:
        console.print(f"warning: {one}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="train_ontology.py")
    return 0
