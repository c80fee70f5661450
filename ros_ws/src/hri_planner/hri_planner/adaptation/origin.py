"""Which planner a model was trained for: other settings or other code may ask for other parameters."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from hri_planner.adaptation.model_file import shipped_names, trained_with
from hri_planner.ptomp.config import load_default_config

TRAINED_FOR = "ptomp"
"""The planner whose parameters models choose."""


@functools.cache
def planner_hash() -> str:
    """Hash (16 hex digits) of the planner's default parameters and the sources of `hri_planner.ptomp`."""
    digest = hashlib.sha256(json.dumps(dataclasses.asdict(load_default_config())).encode())
    folder = Path(str(resources.files("hri_planner.ptomp")))
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def trained_for_another(names: Iterable[str] | None = None) -> list[str]:
    """Those of the models that ship whose planner had other settings or code than the present one.

    Args:
        names: Of models; none: all that ship.

    Raises:
        ConfigError: when one does not ship.
        DataError: when a file is unusable.
    """
    chosen = shipped_names() if names is None else names
    return [name for name in chosen if trained_with(name).get("planner") != planner_hash()]


def unfit(model: str, variant: str) -> str:
    """Why a model does not suit the planner that is to use it; empty when it does.

    Args:
        model: A file or the name of one that ships.
        variant: Name of the planner.

    Raises:
        ConfigError: when no such model ships.
        DataError: when the file is missing or unusable.
    """
    if variant != TRAINED_FOR:
        return f"{model} was trained for {TRAINED_FOR}, not for {variant}"
    if trained_with(model).get("planner") != planner_hash():
        return f"{model} was trained for other settings or other code of {TRAINED_FOR}"
    return ""


def warning(models: Iterable[str]) -> str:
    """A line that says so of models."""
    named = ", ".join(f"`{name}`" for name in models)
    return (
        f"Warning: trained for other settings of the planner than the present ones: {named}. "
        "`scripts/train_adaptation.py` trains anew."
    )
