"""Libraries that little needs, and that are therefore not installed everywhere."""

from __future__ import annotations

import importlib.util

from hri_prediction.errors import ConfigError


def check_scikit_learn() -> None:
    """Say at once that training will need what is not installed.

    Raises:
        ConfigError: naming the command that installs it.
    """
    _check("training", "scikit-learn", "sklearn")


def check_networkx() -> None:
    """Say at once that drawing graphs will need what is not installed.

    Raises:
        ConfigError: naming the command that installs it.
    """
    _check("drawing the cases", "networkx", "networkx")


def _check(what: str, library: str, module: str) -> None:
    if importlib.util.find_spec(module) is None:
        raise ConfigError(
            f"{what} needs {library}, which is not installed",
            hint="run: .venv/bin/python -m pip install -r requirements/training.txt",
        )
