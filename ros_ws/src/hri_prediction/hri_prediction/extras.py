"""Libraries that little needs, and that are therefore not installed everywhere."""

from __future__ import annotations

import importlib.util

from hri_prediction.errors import ConfigError


def check_scikit_learn() -> None:
    """Say at once that training will need what is not installed.

    Raises:
        ConfigError: naming the command that installs it.
    """
    if importlib.util.find_spec("sklearn") is None:
        raise ConfigError(
            "training needs scikit-learn, which is not installed",
            hint="run: .venv/bin/python -m pip install -r requirements/training.txt",
        )
