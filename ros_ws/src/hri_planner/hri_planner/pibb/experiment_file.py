"""Experiments in YAML: those that ship, and one's own."""

from __future__ import annotations

import difflib
from dataclasses import asdict
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from hri_planner.dmp.policy import DURATIONS_S
from hri_planner.pibb.costs import WEIGHTS, CostWeights
from hri_planner.pibb.experiment import TABLE, Experiment, Improvement
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError, DataError, cut, shown
from hri_prediction.files.values import read_yaml

FloatArray = NDArray[np.float64]


def shipped_experiments() -> list[str]:
    """Experiments that ship with the package, by name."""
    folder = Path(str(resources.files("hri_planner.experiments")))
    return sorted(found.stem for found in folder.glob("*.yaml"))


def find_experiment(name: str) -> Path:
    """The file of an experiment: itself if it ends in ``.yaml``, else one that ships.

    Raises:
        ConfigError: when no such experiment ships, naming those that do.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    known = shipped_experiments()
    if name not in known:
        near = difflib.get_close_matches(name, known, 3) or known
        raise ConfigError(
            f"experiment {name!r}", expected=f"a .yaml file, or one like {', '.join(near)}"
        )
    return Path(str(resources.files("hri_planner.experiments"))) / f"{name}.yaml"


def load_experiment(path: str | Path) -> Experiment:
    """Read an experiment from a YAML file.

    Raises:
        ConfigError: when it cannot be read, or a value cannot be used.
    """
    content = read_yaml(path, expected="an experiment in YAML")
    try:
        return experiment_of(content)
    except (ConfigError, DataError) as error:
        raise ConfigError(f"{path}: {error}") from error


_KEYS = (
    "name", "posture", "goals", "targets", "boxes", "table", "duration", "response", "avoidance",
    "weights", "improvement",
)  # fmt: skip


def experiment_of(content: object) -> Experiment:
    """An experiment from a mapping, as YAML and JSON give it.

    Raises:
        ConfigError: when a key is not known or missing, or a value cannot be used.
    """
    if not isinstance(content, dict):
        raise ConfigError(
            f"experiment is {shown(content)}", expected="a mapping: " + ", ".join(_KEYS)
        )
    unknown = [str(key) for key in content if key not in _KEYS]
    if unknown:
        near = difflib.get_close_matches(cut(unknown[0]), _KEYS, 1)
        hint = f"perhaps {near[0]}" if near else ""
        raise ConfigError(cut(", ".join(unknown)), expected="one of " + ", ".join(_KEYS), hint=hint)
    missing = [key for key in ("name", "posture", "goals", "targets") if key not in content]
    if missing:
        raise ConfigError(
            f"no {', '.join(missing)}", expected="all of name, posture, goals, targets"
        )
    weights = content.get("weights", "balanced")
    if isinstance(weights, str):
        if weights not in WEIGHTS:
            raise ConfigError(f"weights {shown(weights)}", expected=", ".join(WEIGHTS))
        chosen = WEIGHTS[weights]
    else:
        chosen = from_mapping(CostWeights, _mapping("weights", weights))
    boxes, table = content.get("boxes") or [], content.get("table")
    try:
        blocks = [_block(box) for box in boxes]
    except (KeyError, TypeError) as error:
        raise ConfigError(f"boxes {shown(boxes)}", expected="each with center and size") from error
    try:
        top = np.array(TABLE if table is None else _block(table))
    except (KeyError, TypeError) as error:
        raise ConfigError(f"table {shown(table)}", expected="center and size") from error
    duration = content.get("duration", 2.5)
    low, high = DURATIONS_S
    number = isinstance(duration, int | float) and not isinstance(duration, bool)
    if not number or not low <= duration <= high:
        raise ConfigError(f"duration {shown(duration)}", expected=f"{low} to {high} s")
    avoidance = content.get("avoidance", True)
    if not isinstance(avoidance, bool):
        raise ConfigError(f"avoidance {shown(avoidance)}", expected="true or false")
    return Experiment(
        name=str(content["name"]),
        posture=_place("posture", content["posture"], 7),
        goals=_places("goals", content["goals"]),
        targets=_places("targets", content["targets"]),
        boxes=np.array(blocks).reshape(-1, 2, 3),
        duration=float(duration),
        response=str(content.get("response", "hand")),
        table=top,
        avoidance=avoidance,
        weights=chosen,
        improvement=from_mapping(
            Improvement, _mapping("improvement", content.get("improvement") or {})
        ),
    )


def to_mapping(experiment: Experiment) -> dict[str, Any]:
    """As :func:`experiment_of` takes it."""
    return {
        "name": experiment.name,
        "posture": [float(v) for v in experiment.posture],
        "duration": experiment.duration,
        "response": experiment.response,
        "avoidance": experiment.avoidance,
        "goals": {name: [float(v) for v in place] for name, place in experiment.goals.items()},
        "targets": {name: [float(v) for v in place] for name, place in experiment.targets.items()},
        "boxes": [_size_of(box) for box in experiment.boxes],
        "table": _size_of(experiment.table),
        "weights": asdict(experiment.weights),
        "improvement": asdict(experiment.improvement),
    }


def _block(content: Any) -> tuple[FloatArray, FloatArray]:
    """Centre and half the size of a box that is given by centre and size."""
    return _place("centre", content["center"]), 0.5 * _place("size", content["size"])


def _size_of(block: FloatArray) -> dict[str, list[float]]:
    """What :func:`_block` takes."""
    return {"center": [float(v) for v in block[0]], "size": [float(2.0 * v) for v in block[1]]}


def _mapping(what: str, content: object) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise ConfigError(f"{what} {shown(content)}", expected="values by name")
    return content


def save_experiment(path: str | Path, experiment: Experiment) -> None:
    """Write an experiment as YAML that :func:`load_experiment` reads back equal.

    Raises:
        ConfigError: when the file cannot be written.
    """
    text = yaml.safe_dump(
        to_mapping(experiment), sort_keys=False, default_flow_style=None, width=100
    )
    try:
        Path(path).write_text(text)
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror}") from error


def _places(what: str, content: object) -> dict[str, FloatArray]:
    if not isinstance(content, dict):
        raise ConfigError(f"{what} {shown(content)}", expected="places by name")
    return {str(name): _place(f"{what}: {name}", place) for name, place in content.items()}


def _place(what: str, content: object, count: int = 3) -> FloatArray:
    try:
        place = np.array(content, dtype=float)
    except (ArithmeticError, TypeError, ValueError) as error:
        raise ConfigError(f"{cut(what)} {shown(content)}", expected=f"{count} numbers") from error
    if place.shape != (count,) or not np.isfinite(place).all():
        raise ConfigError(f"{cut(what)} {shown(content)}", expected=f"{count} finite numbers")
    return place
