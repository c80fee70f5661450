"""An arm and its solver; makes this folder's helpers importable."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.ocp import ReachSolver

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def arm() -> ArmModel:
    return ArmModel.of_body()


@pytest.fixture(scope="session")
def solver(arm: ArmModel) -> ReachSolver:
    return ReachSolver(arm)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)
