"""Command line of ``scripts/fit_weights.py``: from explained reaches to what to expect of anybody."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.files.values import read_json
from hri_prediction.hybrid.fitting import (
    LEAST_REACHES,
    data_of_reaches,
    fit_process,
    says_something,
)
from hri_prediction.hybrid.left_out import (
    LEAST_PEOPLE,
    Law,
    by_person,
    people_left_out,
    reaches_left_out,
    whose,
    without_each,
)
from hri_prediction.hybrid.of_laws import data_of_laws
from hri_prediction.hybrid.weight_file import check_arm, save_process
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess
from hri_prediction.results.options import make_folders, run_app

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True, eq=False)
class Explained:
    """What results of ``scripts/fit_ioc.py`` say of weights.

    Attributes:
        data: Weights.
        what: What they are of, in words.
        laws: Of people's whole reaches, where they are known: these say more than each reach by itself.
        person: Whose each reach is, where there are no laws; empty where the file does not say.
        cut: Whether reaches were cut where they were slow.
    """

    data: WeightData
    what: str
    laws: tuple[Law, ...] = ()
    person: tuple[str, ...] = ()
    cut: bool = False


def read_results(path: Path) -> Explained:
    """Weights in results of ``scripts/fit_ioc.py``.

    Raises:
        DataError: the file is none of these, or laws were asked for and none was found.
    """
    values = read_json(path)
    if not isinstance(values, dict) or "reaches" not in values or "costs" not in values:
        raise DataError(f"{path} has no explained reaches", expected="results.json of fit_ioc.py")
    try:
        check_arm(values)
        names, laws = tuple(map(str, values["costs"])), list(values.get("laws", ()))
        if values.get("law") and not laws:
            raise DataError(
                "no law was found of anybody, though fit_ioc.py was given --law",
                expected="a law of one person at least: single reaches know their weights much worse",
                hint="its results.md says what was missing; without --law single reaches are taken",
            )
        if laws and values.get("whole"):
            data = data_of_laws(names, laws)
            what = f"{len(data)} reaches by the laws of {len(laws)} arms"
            return Explained(data, what, tuple(laws))
        rows = list(values["reaches"])
        data = data_of_reaches(names, rows)
        arms = [str(row.get("person", "")) for row in rows if says_something(row)]
        person = tuple(map(whose, arms)) if all(arms) else ()
        cut = not values.get("whole")
        return Explained(data, f"{len(data)} single reaches", person=person, cut=cut)
    except (HriError, TypeError) as error:
        raise DataError(f"{path}: {error}") from error


def describe(process: WeightProcess) -> str:
    """Length scales of a process in words, a line a cost."""
    names = [name for name in process.names if name != "joint_jerk"]
    lines = []
    for i, name in enumerate(names):
        lengths = " ".join(f"{value:.1f}" for value in process.lengths[i])
        lines.append(
            f"log {name}/joint_jerk: mean {process.mean[i]:.2f}, sd {process.amplitude[i] ** 0.5:.2f}, "
            f"lengths [rad] of q1 q2 q3 at the start and the end {lengths}"
        )
    return "\n".join(lines)


def _left_out(explained: Explained, seed: int) -> tuple[dict[str, float], str]:
    """Errors of weights that were not fitted to, for the file and in words."""
    names = by_person(explained.laws) or Counter(explained.person)
    least = 0
    if len(names) >= LEAST_PEOPLE:
        least = (
            min(len(data) for data in without_each(explained.data.names, explained.laws))
            if explained.laws
            else len(explained.data) - max(Counter(explained.person).values())
        )
    if least < LEAST_REACHES:
        return {}, (
            f"how far off the weights of others are is not known: {LEAST_PEOPLE} people are needed, whose "
            f"names the file has, and {LEAST_REACHES} reaches without any one of them; here are "
            f"{len(names)} people and {len(explained.data)} reaches"
            + (f", {least} without one of them" if least else "")
        )
    if explained.laws:
        own, plain = people_left_out(explained.data.names, explained.laws, seed)
    else:
        own, plain = reaches_left_out(explained.data, explained.person, seed)
    left, of_whom = (
        {"people": float(len(names))},
        f"of people who are left out ({len(names)} in turn)",
    )
    said = f"weights {of_whom} are off by {own:.3f}, those of the mean of the others by {plain:.3f}"
    return {"weights_off": own, "mean_weights_off": plain, **left}, said


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def fit_weights(
    results: Annotated[Path, typer.Argument(help="results.json of fit_ioc.py.")],
    out: Annotated[Path, typer.Option(help="File of the process of weights (JSON).")],
    about: Annotated[
        str,
        typer.Option(
            help="Whose reaches these are, for the file. Default: how many of which file."
        ),
    ] = "",
    seed: Annotated[int, typer.Option(help="Of the starts of the search.", min=0)] = 0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the weights that --out has.")
    ] = False,
) -> None:
    """Fit Gaussian processes to explained reaches: which weights of costs to expect between two postures.

    Of results of fit_ioc.py --law --whole the laws are taken, the mean of all people for each task: they
    are known much better than weights of single reaches, of cut ones most of all. The file is what the
    predictor takes as its parameter `weights`. Reaches must have been explained with fit_ioc.py
    --convention yaw_pitch_elbow_pitch, the arm that the predictor has. Needs scikit-learn:
    .venv/bin/python -m pip install -r requirements/training.txt
    """
    if out.is_dir():
        raise ConfigError(f"--out {out} is a folder", expected="a file")
    if out.exists() and not overwrite:
        raise ConfigError(
            f"--out {out} is there already", hint="name another file, or add --overwrite"
        )
    explained = read_results(results)
    data, what = explained.data, explained.what
    make_folders(out=out.parent)
    if explained.cut:
        print(
            "warning: these reaches were cut where they were slow, and weights of such are off by much "
            "more than they seem to be (docs/motor_control.md); where people rest before and after each "
            "reach, fit_ioc.py --law --whole says more",
            file=sys.stderr,
        )
    process = fit_process(data, seed)
    print(f"{what}; {json.dumps(list(data.names))}")
    print(describe(process))
    errors, said = _left_out(explained, seed)
    print(said)
    save_process(out, process, about or f"{what}, {results.name}", errors)
    print(f"{out}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``fit_weights`` with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "fit_weights.py", argv)
