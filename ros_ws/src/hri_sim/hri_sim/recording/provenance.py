"""What made a recording: versions, revision, command, and what the launcher says about the run."""

from __future__ import annotations

import json
import platform
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from hri_prediction.errors import ConfigError, DataError, cut
from hri_prediction.files.content import read_text
from hri_prediction.files.values import parse_json
from hri_prediction.results.commit import git_revision

_PACKAGES = ("hri-prediction", "hri-planner", "hri-sim", "rclpy", "numpy", "mujoco")


def parse_provenance(text: str) -> dict[str, Any]:
    """Read what the launcher says about a run: a JSON object, or the path of a file with one.

    Raises:
        ConfigError: when it is neither.
    """
    if not text.strip():
        return {}
    source = "the provenance"
    try:
        if not text.lstrip().startswith("{"):
            source = text
            text = read_text(text)
        node = parse_json(text)
    except (DataError, ValueError) as error:
        raise ConfigError(
            f"{source} cannot be read: {cut(str(error), 1000)}",
            expected="a JSON object or a file with one",
        ) from error
    if not isinstance(node, dict):
        raise ConfigError(
            f"{source} is JSON of type {type(node).__name__}", expected="a JSON object"
        )
    return node


def collect_provenance(run: dict[str, Any] | None = None) -> dict[str, Any]:
    """All that is known of how a recording comes about.

    Args:
        run: What only the launcher knows: seed, scenario, parameters, models. Wins over the rest.
    """
    return {
        "recorded_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": " ".join(sys.argv),
        "host": platform.platform(),
        "python": platform.python_version(),
        "packages": {name: found for name in _PACKAGES if (found := _version(name))},
        "git_revision": git_revision(Path(__file__).parent) or git_revision(Path.cwd()),
        **(run or {}),
    }


def custom_data(provenance: dict[str, Any]) -> dict[str, str]:
    """Provenance as the flat strings that metadata.yaml takes; nested values become JSON."""
    return {
        key: value if isinstance(value, str) else json.dumps(value, sort_keys=True)
        for key, value in provenance.items()
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
