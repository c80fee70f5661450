"""What training must remember to go on as if it had never stopped."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError, cut
from hri_prediction.files.values import parse_json
from hri_prediction.promp.storage import read_npz, write_npz

FORMAT = "hri-rnn-training-1"

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TrainingState:
    """After a round.

    Attributes:
        stage: ``"imitation"``, ``"closed_loop"`` or ``"done"``.
        round: Rounds of this stage that are done.
        weights: Present ones, by name.
        best: Those with the best validation of this stage.
        best_value: That validation.
        stale: Rounds since then.
        memory: What the optimiser remembers, by name.
        generator: State of the random generator.
        history: A line for each round so far.
        processor_seconds: That these took [s].
    """

    stage: str
    round: int
    weights: Mapping[str, FloatArray]
    best: Mapping[str, FloatArray]
    best_value: float
    stale: int
    memory: Mapping[str, FloatArray]
    generator: Mapping[str, Any]
    history: tuple[Mapping[str, Any], ...] = field(default=())
    processor_seconds: float = 0.0


_GROUPS = ("weights", "best", "memory")


def save_state(path: Path, state: TrainingState, what: str) -> None:
    """Save it; a half-written file never takes the place of a whole one.

    Args:
        path: Of the ``.npz`` file.
        state: What to save.
        what: Stands for configuration and data: only the same go on from it.
    """
    arrays = {
        f"{group}.{name}": values
        for group in _GROUPS
        for name, values in getattr(state, group).items()
    }
    header = {
        "format": FORMAT,
        "what": what,
        "stage": state.stage,
        "round": state.round,
        "best_value": None if np.isinf(state.best_value) else state.best_value,
        "stale": state.stale,
        "generator": json.dumps(state.generator),
        "history": list(state.history),
        "processor_seconds": state.processor_seconds,
    }
    part = path.with_suffix(".part.npz")
    write_npz(part, arrays, header)
    os.replace(part, path)


def load_state(path: Path, what: str) -> TrainingState | None:
    """The state of training that was broken off; none: there is no file.

    Raises:
        DataError: when the file is damaged, or of another configuration or other data.
    """
    if not path.is_file():
        return None
    arrays, header = read_npz(path, FORMAT)
    if header.get("what") != what:
        raise DataError(
            f"{path}: training of another configuration or other data that was broken off",
            hint="write elsewhere, or remove the file",
        )
    groups: dict[str, dict[str, FloatArray]] = {group: {} for group in _GROUPS}
    try:
        for name, values in arrays.items():
            group, _, rest = name.partition(".")
            groups[group][rest] = values
        best = header["best_value"]
        return TrainingState(
            stage=str(header["stage"]),
            round=int(header["round"]),
            weights=groups["weights"],
            best=groups["best"],
            best_value=float("inf") if best is None else float(best),
            stale=int(header["stale"]),
            memory=groups["memory"],
            generator=dict(parse_json(header["generator"])),
            history=tuple(dict(line) for line in header["history"]),
            processor_seconds=float(header["processor_seconds"]),
        )
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DataError(f"{path}: {cut(repr(error))}", hint="remove it to begin anew") from error
