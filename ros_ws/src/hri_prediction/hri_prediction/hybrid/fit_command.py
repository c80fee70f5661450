"""Command line of ``scripts/fit_weights.py``: from explained reaches to what to expect of anybody."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from hri_prediction.errors import DataError, HriError
from hri_prediction.files.values import read_json
from hri_prediction.hybrid.fitting import data_of_reaches, fit_process
from hri_prediction.hybrid.weight_file import check_arm, save_process
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess, to_alpha
from hri_prediction.results.options import make_folders, run_app

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
_FOLDS = 5
LEAST_LEFT_OUT = 20
"""With fewer reaches, what is left when some are left out is not enough to fit to."""


def read_results(path: Path) -> WeightData:
    """Weights of the reaches in results of ``scripts/fit_ioc.py``.

    Raises:
        DataError: the file is none of these.
    """
    values = read_json(path)
    if not isinstance(values, dict) or "reaches" not in values or "costs" not in values:
        raise DataError(f"{path} has no explained reaches", expected="results.json of fit_ioc.py")
    try:
        check_arm(values)
        return data_of_reaches(tuple(map(str, values["costs"])), list(values["reaches"]))
    except (HriError, TypeError) as error:
        raise DataError(f"{path}: {error}") from error


def left_out(data: WeightData, seed: int = 0) -> tuple[float, float]:
    """Mean absolute error of weights of reaches that are left out: of the process, and of their mean."""
    order = np.random.default_rng(seed).permutation(len(data))
    own, plain = [], []
    for fold in range(_FOLDS):
        held = order[fold::_FOLDS]
        rest = np.setdiff1d(order, held)
        process = fit_process(_rows(data, rest), seed)
        truth = to_alpha(data.logs[held], data.names)
        mean = to_alpha(data.logs[rest], data.names).mean(axis=0)
        guesses = np.array([process.guess(row[:3], row[3:]).alpha for row in data.inputs[held]])
        own.append(np.abs(guesses - truth).mean())
        plain.append(np.abs(mean - truth).mean())
    return float(np.mean(own)), float(np.mean(plain))


def _rows(data: WeightData, rows: np.ndarray) -> WeightData:
    return WeightData(data.names, data.inputs[rows], data.logs[rows], data.variance[rows])


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

    The file is what the predictor takes as its parameter `weights`. Reaches must have been explained with
    fit_ioc.py --convention yaw_pitch_elbow_pitch, the arm that the predictor has. Needs scikit-learn:
    .venv/bin/python -m pip install -r requirements/training.txt
    """
    data = read_results(results)
    make_folders(out=out.parent)
    process = fit_process(data, seed)
    errors = {}
    print(f"{len(data)} reaches; {json.dumps(list(data.names))}")
    print(describe(process))
    if len(data) >= LEAST_LEFT_OUT:
        own, plain = left_out(data, seed)
        errors = {"weights_off": own, "mean_weights_off": plain, "parts": float(_FOLDS)}
        print(
            f"reaches left out ({_FOLDS} parts): weights are off by {own:.3f}, "
            f"those of the mean by {plain:.3f}"
        )
    save_process(out, process, about or f"{len(data)} reaches of {results.name}", errors)
    print(f"{out}")


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``fit_weights`` with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "fit_weights.py", argv)
