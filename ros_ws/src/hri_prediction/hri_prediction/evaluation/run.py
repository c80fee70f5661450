"""An evaluation: all folds on all cores, each kept in a file as soon as it is done, then summed up."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import importlib.metadata
import importlib.util
import json
import os
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import source_hash
from hri_prediction.errors import DataError
from hri_prediction.evaluation.folds import (
    CONSTANT_VELOCITY,
    OURS,
    TOLD_DURATION,
    TOLD_TASK,
    Fold,
    Settings,
    evaluate_fold,
    make_folds,
)
from hri_prediction.evaluation.recordings import Recording, content_hash
from hri_prediction.evaluation.scores import FIELDS, share_of, spread_of, summarise
from hri_prediction.promp.storage import read_npz, write_npz

Arrays = dict[str, NDArray[np.float64]]
FORMAT = "hri-evaluation-fold-1"
HEADLINE = 0.3
"""Observed share of the figures that stand first, if it is among those asked for."""
REFERENCE = "movement_primitives"

_UNTOLD = (
    "samples up to now; onset as our segmentation finds it in them; learnt from all tasks pooled"
)
_DURATION = "true onset and true duration; learnt from all tasks pooled"
_TASK = "true onset, true duration and the task; learnt from reaches of this task"
KNOWS = {
    OURS: "samples up to now; finds onset, duration and task itself",
    CONSTANT_VELOCITY: "samples up to now; learns nothing (our predictor without a library)",
    "minimum_jerk": f"{_UNTOLD}, whose end points and durations are the prior of the fit",
    "minimum_jerk" + TOLD_DURATION: f"{_DURATION}, whose end points are the prior of the fit",
    "minimum_jerk" + TOLD_TASK: f"{_TASK}, whose end points are the prior of the fit",
    "mean_trajectory": f"{_UNTOLD}; takes their mean duration",
    "mean_trajectory" + TOLD_DURATION: _DURATION,
    "mean_trajectory" + TOLD_TASK: _TASK,
    REFERENCE: f"{_UNTOLD}; takes their mean duration",
    REFERENCE + TOLD_DURATION: _DURATION,
    REFERENCE + TOLD_TASK: _TASK,
}
"""What each predictor is told, in words."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Everything that was measured.

    Args:
        settings: What was evaluated.
        cells: ``<predictor>/<observed>/<field>`` and what else :func:`.evaluate_fold` returns, over
            all reaches in the order of the recordings.
        skipped: One line for each thing that could not take part.
    """

    settings: Settings
    cells: Arrays
    skipped: tuple[str, ...]

    @property
    def headline(self) -> float:
        """The observed share that stands first."""
        shares = self.settings.observed
        return HEADLINE if HEADLINE in shares else shares[0]

    def cell(self, predictor: str, observed: float) -> Arrays:
        """The fields of one predictor and observed share."""
        return {field: self.cells[f"{predictor}/{observed:g}/{field}"] for field in FIELDS}

    def summary(self) -> dict[str, Any]:
        """The content of ``results.json``; whoever calls adds data and origin."""
        by_observed = {
            f"{share:g}": {
                name: summarise(self.cell(name, share)) for name in self.settings.predictors
            }
            for share in self.settings.observed
        }
        return {
            "protocol": self.settings.protocol,
            "n": len(self.cells["reach"]),
            "observed": self.headline,
            "predictors": by_observed[f"{self.headline:g}"],
            "by_observed": by_observed,
            "noticed": {
                f"{share:g}": float(self.cells[f"noticed/{share:g}"].mean())
                for share in self.settings.observed
            },
            "duration_error_s": self._beliefs(lambda cell: spread_of(np.abs(cell[:, 0]))),
            "task_found": self._beliefs(lambda cell: share_of(cell[:, 1] == 1.0, cell[:, 1])),
            "knows": {name: KNOWS[name] for name in self.settings.predictors},
            "skipped": list(self.skipped),
        }

    def _beliefs(self, figure: Callable[[NDArray[np.float64]], Any]) -> dict[str, Any]:
        """A figure of what our predictor believes of duration and task, by observed share."""
        return {
            f"{share:g}": figure(self.cells[f"belief/{share:g}"])
            for share in self.settings.observed
        }


def has_reference() -> bool:
    """Whether the package ``movement_primitives`` is installed."""
    return importlib.util.find_spec(REFERENCE) is not None


def fingerprint(recordings: Sequence[Recording], settings: Settings) -> str:
    """Hash of everything that the folds' results depend on: data, settings, code, libraries."""
    packages = ["numpy", "scipy", "numba"]
    if settings.references:
        packages.append("movement-primitives")
    parts = (
        content_hash(recordings),
        json.dumps(dataclasses.asdict(settings), sort_keys=True),
        source_hash(),
        [importlib.metadata.version(name) for name in packages],
    )
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _read(path: Path, mark: str) -> Arrays | None:
    """What a fold measured earlier; none when it is not there, damaged, or of something else."""
    try:
        arrays, header = read_npz(path, FORMAT)
    except DataError:
        return None
    return arrays if header.get("fingerprint") == mark else None


def _write(path: Path, arrays: Arrays, mark: str) -> None:
    temporary = path.with_suffix(".part.npz")
    write_npz(temporary, arrays, {"format": FORMAT, "fingerprint": mark})
    os.replace(temporary, path)


def _work(recordings: Sequence[Recording], fold: Fold, settings: Settings) -> tuple[str, Arrays]:
    return fold.key, evaluate_fold(recordings, fold, settings)


def evaluate(
    recordings: Sequence[Recording],
    settings: Settings,
    folder: Path,
    *,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Replay all reaches, with everything that each fold may learn from learnt before.

    Results do not depend on the number of workers, but for the latencies.

    Args:
        recordings: Who is predicted, and learnt from.
        settings: What is evaluated.
        folder: Keeps one file a fold. Those of an earlier run that was broken off are used, if data,
            settings and code are the same.
        workers: Processes.
        progress: Called with the numbers of folds done and of all.

    Raises:
        DataError: when there is nothing to evaluate.
    """
    folds, skipped = make_folds(recordings, settings.protocol)
    if not settings.references:
        skipped.append(
            f"{REFERENCE}: the package is not installed (scripts/setup --dev installs it)"
        )
    folder.mkdir(parents=True, exist_ok=True)
    mark = fingerprint(recordings, settings)
    done: dict[str, Arrays] = {}
    for fold in folds:
        earlier = _read(folder / f"{fold.key}.npz", mark)
        if earlier is not None:
            done[fold.key] = earlier
    waiting = [fold for fold in folds if fold.key not in done]
    if progress is not None:
        progress(len(done), len(folds))
    parallel = joblib.Parallel(n_jobs=workers, return_as="generator_unordered")
    work = parallel(joblib.delayed(_work)(recordings, fold, settings) for fold in waiting)
    with warnings.catch_warnings(), contextlib.closing(work):
        # When this is broken off, joblib would warn that work is lost. It is not: it is done next time.
        warnings.filterwarnings("ignore", ".*tasks which were still being processed")
        for key, arrays in work:
            _write(folder / f"{key}.npz", arrays, mark)
            done[key] = arrays
            if progress is not None:
                progress(len(done), len(folds))
    parts = [done[fold.key] for fold in folds]
    cells = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Evaluation(settings, cells, tuple(skipped))
