"""Policies on disk, whatever their kind."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from hri_planner.dmp.model_file import FORMAT as DMP_FORMAT
from hri_planner.dmp.model_file import PREFIX as DMP_PREFIX
from hri_planner.dmp.model_file import load_dmp
from hri_planner.policy.planner import AnyPolicy
from hri_planner.rnn.model_file import FORMAT as RNN_FORMAT
from hri_planner.rnn.model_file import load_policy, shipped_policies
from hri_prediction.errors import ConfigError
from hri_prediction.promp.storage import read_npz


def load_any(path: str | Path) -> AnyPolicy:
    """Load a network, or a policy of movement primitives.

    Raises:
        DataError: when the file is missing, damaged, of another format, or holds what cannot be used.
    """
    _, header = read_npz(path, RNN_FORMAT, DMP_FORMAT)
    return load_dmp(path) if header["format"] == DMP_FORMAT else load_policy(path)


def shipped_dmps() -> list[str]:
    """Policies of movement primitives that ship with the package, by name."""
    return sorted(found.stem for found in _folder().glob(f"{DMP_PREFIX}*.npz"))


def find_any(name: str) -> Path:
    """The file of a policy: itself if it ends in ``.npz``, else one that ships.

    Raises:
        ConfigError: when no such policy ships, naming those that do.
    """
    if name.endswith(".npz"):
        return Path(name)
    known = [*shipped_policies(), *shipped_dmps()]
    if name not in known:
        raise ConfigError(f"policy {name!r}", expected=f"a .npz file, or one of {', '.join(known)}")
    return _folder() / f"{name}.npz"


def find_network(name: str) -> Path:
    """The file of a network that was learnt from people: itself, or one that ships.

    Raises:
        ConfigError: when no such network ships, or it is of another kind.
        DataError: when the file cannot be read.
    """
    return _of_kind(
        name, RNN_FORMAT, shipped_policies(), "a network", "launch_dmp.py runs the others"
    )


def find_dmp(name: str) -> Path:
    """The file of a policy of movement primitives: itself, or one that ships.

    Raises:
        ConfigError: when no such policy ships, or it is of another kind.
        DataError: when the file cannot be read.
    """
    return _of_kind(
        name, DMP_FORMAT, shipped_dmps(), "movement primitives", "launch_rnn.py runs networks"
    )


def _of_kind(name: str, form: str, known: list[str], what: str, hint: str) -> Path:
    expected = f"a .npz file of {what}, or one that ships: {', '.join(known)}"
    if not name.endswith(".npz") and name not in (*shipped_policies(), *shipped_dmps()):
        raise ConfigError(f"policy {name!r}", expected=expected)
    path = find_any(name)
    if read_npz(path, RNN_FORMAT, DMP_FORMAT)[1]["format"] != form:
        raise ConfigError(f"{name} is not {what}", expected=expected, hint=hint)
    return path


def _folder() -> Path:
    return Path(str(resources.files("hri_planner.models")))
