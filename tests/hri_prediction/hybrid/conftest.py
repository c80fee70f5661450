"""An arm, targets and a process of weights for tests of the hybrid predictor."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from hri_prediction.hybrid.body import CONVENTION, BodyArm
from hri_prediction.hybrid.person import HybridPerson, Rest
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.costs import CHAPTER_2

SHOULDER = np.array([0.7, 0.1, 0.4])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.fixture(scope="session")
def body() -> BodyArm:
    """A right arm of somebody who faces along -x."""
    return BodyArm(ArmModel.of_body(convention=CONVENTION), 0.09, np.pi, "right")


@pytest.fixture(scope="session")
def people() -> WeightProcess:
    """What weights are like, made up."""
    rng = np.random.default_rng(0)
    count, width = 20, len(CHAPTER_2) - 1
    data = WeightData(
        CHAPTER_2,
        rng.uniform(-0.5, 1.5, (count, 6)),
        rng.normal(-1.0, 0.5, (count, width)),
        np.full((count, width), 0.1),
    )
    return WeightProcess(
        data, np.full(width, -1.0), np.full(width, 0.3), rng.uniform(0.5, 2.0, (width, 6))
    )


@pytest.fixture(scope="session")
def rest(body: BodyArm) -> Rest:
    """The arm, the hand low before the body."""
    elbow_wrist = body.positions(np.radians([[55.0, 60.0, 80.0]]))[0]
    forearm = elbow_wrist[3:] - elbow_wrist[:3]
    points = np.zeros((4, 3))
    points[1], points[2] = elbow_wrist[:3], elbow_wrist[3:]
    points[3] = elbow_wrist[3:] + forearm * (body.hand_m / np.linalg.norm(forearm))
    return Rest(body, points + SHOULDER)


@pytest.fixture(scope="session")
def targets(body: BodyArm) -> dict[str, np.ndarray]:
    """Two points that the hand gets to."""
    long = BodyArm(
        ArmModel.of_body(
            upper_m=body.arm.upper_m,
            forearm_m=body.arm.forearm_m + body.hand_m,
            convention=CONVENTION,
        ),
        0.0,
        body.facing_rad,
        body.side,
    )
    postures = np.radians([[20.0, 75.0, 40.0], [35.0, 40.0, 30.0]])
    tips = long.positions(postures)[:, 3:] + SHOULDER
    return {"near": tips[0], "side": tips[1]}


@pytest.fixture
def person(targets: dict[str, np.ndarray], people: WeightProcess) -> HybridPerson:
    return HybridPerson(targets, people)
