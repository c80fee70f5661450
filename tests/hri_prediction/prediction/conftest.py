"""Synthetic reaches: two tasks, one person, minimum jerk with scatter."""

import numpy as np
import pytest

from hri_prediction.prediction import PredictorConfig, TaskLibrary, train_library
from hri_prediction.tracks.track import ArmTrack

SHOULDER = np.array([0.7, 0.2, 0.5])
TARGETS = {"left bin": np.array([-0.45, -0.25, -0.1]), "right bin": np.array([-0.45, 0.25, -0.1])}
HOME = np.array([-0.2, 0.0, -0.35])


def arm(wrist: np.ndarray) -> np.ndarray:
    """Keypoints (N, 4, 3) about SHOULDER for wrist positions (N, 3) relative to it."""
    upper, fore = 0.29, 0.26
    distance = np.linalg.norm(wrist, axis=1, keepdims=True)
    axis = wrist / distance
    along = (upper**2 - fore**2 + distance**2) / (2 * distance)
    height = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    down = np.array([0.0, 0.0, -1.0]) - axis * (axis @ np.array([0.0, 0.0, -1.0]))[:, None]
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    elbow = axis * along + down * height
    hand = wrist + 0.09 * (wrist - elbow) / fore
    relative = np.stack([np.zeros_like(wrist), elbow, wrist, hand], axis=1)
    return SHOULDER + relative


def make_reach(
    task: str,
    rng: np.random.Generator,
    rate: float = 100.0,
    noise: float = 0.0005,
    target: np.ndarray | None = None,
    subject: str = "one",
    duration: float | None = None,
    trial: int = 0,
) -> ArmTrack:
    """0.5 s of rest, a reach of about 1 s, 0.5 s of rest."""
    length = duration or 1.0 + 0.1 * rng.standard_normal()
    time = np.arange(0.0, length + 1.0, 1.0 / rate)
    z = np.clip((time - 0.5) / length, 0.0, 1.0)
    rise = z**3 * (10 - 15 * z + 6 * z**2)
    start = HOME + 0.005 * rng.standard_normal(3)
    end = (TARGETS[task] if target is None else target) + 0.01 * rng.standard_normal(3)
    wrist = start + rise[:, None] * (end - start)
    wrist[:, 2] += 0.06 * np.sin(np.pi * rise)
    points = arm(wrist) + noise * rng.standard_normal((time.size, 4, 3))
    return ArmTrack(time, points, "right", subject, task, trial, "synthetic")


@pytest.fixture(scope="session")
def config() -> PredictorConfig:
    return PredictorConfig()


@pytest.fixture(scope="session")
def tracks() -> list[ArmTrack]:
    rng = np.random.default_rng(0)
    return [make_reach(task, rng, trial=i) for task in TARGETS for i in range(6)]


@pytest.fixture(scope="session")
def library(tracks: list[ArmTrack], config: PredictorConfig) -> TaskLibrary:
    return train_library(tracks, config)


@pytest.fixture(scope="session")
def reach_maker():
    return make_reach
