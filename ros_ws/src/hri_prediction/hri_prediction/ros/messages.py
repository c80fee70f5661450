"""Imports of this project's messages, with a check that they are this project's.

A package of the same name exists upstream (ROS4HRI). Our type names are disjoint from its own but for
``IdsList``, so a missing type means that the wrong package is in front.
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import TracebackType

from hri_prediction.errors import GraphError


def _one_line(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Say what is wrong in one line: nodes import this before anything of theirs could."""
    if isinstance(error, GraphError):
        print(f"{Path(sys.argv[0]).name}: error: {error}", file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)


try:
    import hri_msgs
except ImportError as error:
    sys.excepthook = _one_line
    raise GraphError(
        "the package hri_msgs is not installed",
        hint="run scripts/setup, or build ros_ws with colcon and source its install/setup.bash",
    ) from error

try:
    from hri_msgs.action import ReachTarget
    from hri_msgs.msg import (
        AdaptationStatus,
        ControllerState,
        Cue,
        GoalGuess,
        HumanArm,
        HumanPrediction,
        IdsList,
        InteractionCase,
        InteractionFeatures,
        PlannerStatus,
        PolicyStatus,
        SeparationStatus,
        SimState,
    )
    from hri_msgs.srv import LoadModel, Reset
except ImportError as error:
    sys.excepthook = _one_line
    _where = getattr(hri_msgs, "__file__", None) or list(hri_msgs.__path__)
    raise GraphError(
        f"the hri_msgs found at {_where} is not this project's ({error})",
        expected="the hri_msgs built from ros_ws/src/hri_msgs",
        hint="another package of that name (ROS4HRI) is in front: source this workspace last, "
        "or take the other out of PYTHONPATH and AMENT_PREFIX_PATH",
    ) from error

__all__ = [
    "AdaptationStatus",
    "ControllerState",
    "Cue",
    "GoalGuess",
    "HumanArm",
    "HumanPrediction",
    "IdsList",
    "InteractionCase",
    "InteractionFeatures",
    "LoadModel",
    "PlannerStatus",
    "PolicyStatus",
    "ReachTarget",
    "Reset",
    "SeparationStatus",
    "SimState",
]
