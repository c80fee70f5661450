"""Names of experiments and people, which are names of files and folders too."""

from __future__ import annotations

import re

from hri_prediction.errors import ConfigError, shown

_NAME = re.compile(r"\w[\w.-]{0,59}")


def is_name(name: str) -> bool:
    """Whether it can be the name of a file on any system."""
    return _NAME.fullmatch(name) is not None


def check_name(what: str, name: str) -> None:
    """Check the name of an experiment or person before anything is done that it is to name.

    Raises:
        ConfigError: when it cannot be the name of a file.
    """
    if not is_name(name):
        raise ConfigError(
            f"{what} {shown(name)} cannot be the name of a file",
            expected="up to 60 letters, digits, dots, - and _, of which a letter, digit or _ first",
        )
