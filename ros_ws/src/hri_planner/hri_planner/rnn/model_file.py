"""Policies on disk: ``.npz`` files of plain arrays with a JSON header, never pickles."""

from __future__ import annotations

from dataclasses import asdict
from importlib import resources
from pathlib import Path
from typing import Any

from hri_planner.rnn.features import INPUTS, FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.network import Network
from hri_planner.rnn.scales import Scales
from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError, DataError, HriError, shown
from hri_prediction.promp.storage import read_npz, write_npz

FORMAT = "hri-rnn-1"
PREFIX = "rnn_"


def save_policy(path: str | Path, model: PolicyModel, trained: dict[str, Any]) -> None:
    """Save a policy.

    Args:
        path: Of the ``.npz`` file.
        model: What to save.
        trained: How it came about, for the header: values that JSON can hold.
    """
    header = {
        "format": FORMAT,
        "cell": model.network.kind,
        "units": list(model.network.units),
        "inputs": list(INPUTS),
        "features": asdict(model.features),
        "scales": asdict(model.scales),
        "dt": model.dt,
        "trained": trained,
    }
    write_npz(path, model.network.to_arrays(), header)


def load_policy(path: str | Path) -> PolicyModel:
    """Load a policy; it acts as it did before it was saved, to the bit.

    Raises:
        DataError: when the file is missing, damaged, of another format, for other features, or holds
            unusable arrays.
    """
    return read_policy(path)[0]


def read_policy(path: str | Path) -> tuple[PolicyModel, dict[str, Any]]:
    """A policy, and how it came about.

    Raises:
        DataError: as :func:`load_policy`.
    """
    arrays, header = read_npz(path, FORMAT)
    try:
        if header.get("inputs") != list(INPUTS):
            raise DataError(f"inputs {shown(header.get('inputs'))}", expected=f"{list(INPUTS)}")
        network = Network.from_arrays(arrays, _text(header, "cell"), _sizes(header))
        model = PolicyModel(
            network,
            from_mapping(Scales, _mapping(header, "scales")),
            from_mapping(FeatureConfig, _mapping(header, "features")),
            _number(header, "dt"),
        )
    except (HriError, OverflowError, TypeError) as error:
        raise DataError(f"{path}: {error}") from error
    trained = header.get("trained")
    return model, trained if isinstance(trained, dict) else {}


def _text(header: dict[str, Any], name: str) -> str:
    value = header.get(name)
    if not isinstance(value, str):
        raise DataError(f"{name} = {shown(value)}", expected="a word")
    return value


def _number(header: dict[str, Any], name: str) -> float:
    value = header.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DataError(f"{name} = {shown(value)}", expected="a number")
    return float(value)


def _mapping(header: dict[str, Any], name: str) -> dict[str, Any]:
    value = header.get(name)
    if not isinstance(value, dict):
        raise DataError(f"{name} = {shown(value)}", expected="numbers by name")
    return value


def _sizes(header: dict[str, Any]) -> tuple[int, ...]:
    value = header.get("units")
    if not isinstance(value, list) or not all(type(size) is int for size in value):
        raise DataError(f"units = {shown(value)}", expected="a whole number for each layer")
    return tuple(value)


def _folder() -> Path:
    return Path(str(resources.files("hri_planner.models")))


def shipped_policies() -> list[str]:
    """Policies that ship with the package, by name."""
    return sorted(found.stem for found in _folder().glob(f"{PREFIX}*.npz"))


def find_policy(name: str) -> Path:
    """The file of a policy: itself if it ends in ``.npz``, else one that ships.

    Raises:
        ConfigError: when no such policy ships, naming those that do.
    """
    if name.endswith(".npz"):
        return Path(name)
    path = _folder() / f"{name}.npz"
    if name not in shipped_policies():
        known = ", ".join(shipped_policies())
        raise ConfigError(f"policy {name!r}", expected=f"a .npz file, or one of {known}")
    return path
