"""Whether a folder may have the results of a command that goes on where it was broken off."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.values import read_json


def check_used(out: Path, file: str, settings: Mapping[str, Any], *, overwrite: bool) -> None:
    """Whether a folder is free, or holds what the same command has done.

    Args:
        out: The folder.
        file: Of the results, JSON that has the settings among others.
        settings: What is asked for now.
        overwrite: Results of something else may be there; they are replaced when there are new ones.

    Raises:
        ConfigError: it holds results of other options, which are named.
    """
    first = out / file
    if overwrite or not first.is_file():
        return
    hint = "name another one, or add --overwrite"
    try:
        before = read_json(first)
    except DataError:
        before = None
    if not isinstance(before, dict):
        raise ConfigError(
            f"{first} is no result of this command", expected="a folder of its own", hint=hint
        )
    # What older results do not say is taken to be the same.
    other = [name for name, value in settings.items() if before.get(name, value) != value]
    if other:
        raise ConfigError(
            f"{out} holds results with other {', '.join(other)}",
            expected="a folder of its own for each set of options",
            hint=hint,
        )
