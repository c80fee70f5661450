"""Policies of movement primitives on disk: ``.npz`` files of plain arrays with a JSON header."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.dmp.policy import DmpPolicy
from hri_prediction.errors import DataError, HriError, shown
from hri_prediction.promp.storage import read_npz, write_npz

FORMAT = "hri-dmp-1"
PREFIX = "dmp_"


def save_dmp(path: str | Path, policy: DmpPolicy, learnt: dict[str, Any]) -> None:
    """Save a policy.

    Args:
        path: Of the ``.npz`` file.
        policy: What to save.
        learnt: How it came about, for the header: values that JSON can hold.
    """
    names = list(policy.names)
    header = {"format": FORMAT, "goals": names, "duration": policy.duration, "learnt": learnt}
    arrays = {
        "start": policy.start,
        "posture": policy.posture,
        "goals": np.array([policy.goals[name] for name in names]),
        "weights": np.array([policy.weights[name] for name in names]),
    }
    write_npz(path, arrays, header)


def read_dmp(path: str | Path) -> tuple[DmpPolicy, dict[str, Any]]:
    """A policy, and how it came about.

    Raises:
        DataError: when the file is missing, damaged, of another format, or holds what cannot be used.
    """
    arrays, header = read_npz(path, FORMAT)
    names, learnt = header.get("goals"), header.get("learnt")
    try:
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise DataError(f"goals {shown(names)}", expected="their names")
        if len(set(names)) < len(names):
            raise DataError(f"goals {shown(names)}", expected="names that differ")
        missing = {"start", "posture", "goals", "weights"} - set(arrays)
        if missing:
            raise DataError(f"no {', '.join(sorted(missing))}", expected="a whole file")
        for name in ("goals", "weights"):
            if len(arrays[name]) != len(names):
                raise DataError(f"{len(arrays[name])} {name}", expected=f"{len(names)}")
        policy = DmpPolicy(
            np.asarray(arrays["start"], dtype=float),
            np.asarray(arrays["posture"], dtype=float),
            {
                name: np.array(goal, float)
                for name, goal in zip(names, arrays["goals"], strict=True)
            },
            {
                name: np.array(own, float)
                for name, own in zip(names, arrays["weights"], strict=True)
            },
            float(header.get("duration", np.nan)),
        )
    except (HriError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DataError(f"{path}: {error}") from error
    return policy, learnt if isinstance(learnt, dict) else {}


def load_dmp(path: str | Path) -> DmpPolicy:
    """Load a policy; errors as :func:`read_dmp`."""
    return read_dmp(path)[0]
