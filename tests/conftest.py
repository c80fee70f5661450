"""Which tests run alone: those that nodes or clocks have a part in, which other load would disturb."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import settings

# What an example takes depends on what is compiled, loaded or run beside it: no bar of a test.
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")

HERE = Path(__file__).parent
ALONE = (
    "hri_planner/ros",
    "hri_prediction/live",
    "hri_prediction/ros",
    "hri_sim/health",
    "hri_sim/launch",
    "hri_sim/recording",
    "launch",
)
"""Folders of such tests; ``scripts/test`` runs all others in several processes."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark them."""
    for item in items:
        folder = item.path.parent.relative_to(HERE).as_posix()
        if any(folder == one or folder.startswith(f"{one}/") for one in ALONE):
            item.add_marker(pytest.mark.alone)
