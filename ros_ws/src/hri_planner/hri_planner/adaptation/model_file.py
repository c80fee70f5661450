"""Models of adaptation on disk: ``.npz`` files of plain arrays with a JSON header, never pickles."""

from __future__ import annotations

from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.adaptation.best_fixed import BestFixed
from hri_planner.adaptation.features import FEATURES
from hri_planner.adaptation.gpr_selection import GprSelection
from hri_planner.adaptation.grid import Selection
from hri_planner.adaptation.success_selection import SuccessSelection
from hri_prediction.errors import ConfigError, DataError, shown
from hri_prediction.promp.storage import read_npz, write_npz

FORMAT = "hri-adaptation-1"

AnySelection = BestFixed | GprSelection | SuccessSelection
KINDS: dict[str, type[AnySelection]] = {
    "fixed": BestFixed,
    "gpr": GprSelection,
    "success": SuccessSelection,
}
"""What a file may hold, by the name that its header gives it."""


def save_model(path: str | Path, model: AnySelection, trained: dict[str, Any]) -> None:
    """Save a model.

    Args:
        path: Of the ``.npz`` file.
        model: What to save.
        trained: How it came about, for the header: values that JSON can hold.
    """
    kind = next(name for name, made in KINDS.items() if isinstance(model, made))
    header = {"format": FORMAT, "kind": kind, "features": list(FEATURES), "trained": trained}
    write_npz(path, model.to_arrays(), header)


def load_model(path: str | Path) -> AnySelection:
    """Load a model; it chooses as it did before it was saved.

    Raises:
        DataError: when the file is missing, damaged, of another format, or holds unusable arrays.
    """
    arrays, header = read_npz(path, FORMAT)
    kind = header.get("kind")
    made = KINDS.get(kind) if isinstance(kind, str) else None
    if made is None:
        raise DataError(
            f"{path} holds a model {shown(kind)}", expected="one of " + ", ".join(KINDS)
        )
    if header.get("features") != list(FEATURES):
        raise DataError(
            f"{path} is for the inputs {shown(header.get('features'))}",
            expected=f"{list(FEATURES)}",
        )
    shapes = made.shapes(arrays)
    if set(arrays) != set(shapes):
        raise DataError(f"{path} holds {shown(sorted(arrays))}", expected=f"{sorted(shapes)}")
    for name, shape in shapes.items():
        values = arrays[name]
        if values.shape != shape or values.dtype != np.float64:
            raise DataError(
                f"{path}: {name} has shape {values.shape}, type {values.dtype}",
                expected=f"{shape}, float64",
            )
        if not np.all(np.isfinite(values)):
            raise DataError(f"{path}: {name} holds NaN or infinity")
    for name in ("scale", "spread", "lengths"):
        if name in arrays and np.min(arrays[name]) <= 0.0:
            raise DataError(f"{path}: {name} is not positive")
    try:
        return made.from_arrays(arrays)
    except (ArithmeticError, ValueError) as error:
        raise DataError(f"{path}: {error}") from error


POLICY_PREFIXES = ("rnn_", "dmp_")
"""Policies, which ship in the same folder, are no models of adaptation."""


def _folder() -> Path:
    return Path(str(resources.files("hri_planner.models")))


def shipped_names() -> list[str]:
    """The models that ship with the package."""
    names = sorted(found.stem for found in _folder().glob("*.npz"))
    return [name for name in names if not name.startswith(POLICY_PREFIXES)]


def shipped_path(name: str) -> Path:
    """The file of a model that ships with the package.

    Raises:
        ConfigError: naming those that there are.
    """
    path = _folder() / f"{name}.npz"
    if not path.is_file():
        known = ", ".join(shipped_names())
        raise ConfigError(f"adaptation model {name!r}", expected=f"one of {known}")
    return path


def trained_with(name: str) -> dict[str, Any]:
    """How a model came about, as :func:`save_model` was told; named as in :func:`find_model`.

    Raises:
        ConfigError: when no such model ships.
        DataError: when the file is missing or unusable.
    """
    path = Path(name) if name.endswith(".npz") else shipped_path(name)
    found = read_npz(path, FORMAT)[1].get("trained")
    return found if isinstance(found, dict) else {}


def find_model(name: str) -> Selection:
    """A model by its file, which ends in ``.npz``, or by the name of one that ships.

    Raises:
        ConfigError: when no such model ships.
        DataError: when the file is missing or unusable.
    """
    return load_model(name) if name.endswith(".npz") else shipped_model(name)


@lru_cache(maxsize=8)
def shipped_model(name: str) -> Selection:
    """A model that ships with the package.

    Raises:
        ConfigError: naming those that there are.
        DataError: when its file is unusable.
    """
    return load_model(shipped_path(name))
