"""Command line of ``scripts/fit_weights.py``: from explained reaches to what to expect of anybody."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from hri_prediction.errors import DataError, HriError
from hri_prediction.files.values import read_json
from hri_prediction.hybrid.fitting import data_of_reaches, fit_process
from hri_prediction.hybrid.left_out import (
    LEAST_PEOPLE,
    LEAST_REACHES,
    PARTS,
    Law,
    by_person,
    people_left_out,
    reaches_left_out,
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
    """

    data: WeightData
    what: str
    laws: tuple[Law, ...] = ()


def read_results(path: Path) -> Explained:
    """Weights in results of ``scripts/fit_ioc.py``.

    Raises:
        DataError: the file is none of these.
    """
    values = read_json(path)
    if not isinstance(values, dict) or "reaches" not in values or "costs" not in values:
        raise DataError(f"{path} has no explained reaches", expected="results.json of fit_ioc.py")
    try:
        check_arm(values)
        names, laws = tuple(map(str, values["costs"])), list(values.get("laws", ()))
        if laws and values.get("whole"):
            data = data_of_laws(names, laws)
            what = f"{len(data)} reaches by the laws of {len(laws)} arms"
            return Explained(data, what, tuple(laws))
        data = data_of_reaches(names, list(values["reaches"]))
        return Explained(data, f"{len(data)} reaches")
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
    people = len(by_person(explained.laws))
    if people >= LEAST_PEOPLE:
        own, plain = people_left_out(explained.data.names, explained.laws, seed)
        left, of_whom = {"people": float(people)}, f"of people who are left out ({people} in turn)"
    elif not explained.laws and len(explained.data) >= LEAST_REACHES:
        own, plain = reaches_left_out(explained.data, seed)
        left, of_whom = {"parts": float(PARTS)}, f"of reaches that are left out ({PARTS} parts)"
    else:
        return {}, "too few to leave some out, and to see how far off the weights of others are"
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
) -> None:
    """Fit Gaussian processes to explained reaches: which weights of costs to expect between two postures.

    Of results of fit_ioc.py --law --whole the laws are taken, the mean of all people for each task: they
    are known much better than weights of single reaches. The file is what the predictor takes as its
    parameter `weights`. Reaches must have been explained with fit_ioc.py --convention
    yaw_pitch_elbow_pitch, the arm that the predictor has. Needs scikit-learn:
    .venv/bin/python -m pip install -r requirements/training.txt
    """
    explained = read_results(results)
    data, what = explained.data, explained.what
    make_folders(out=out.parent)
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
