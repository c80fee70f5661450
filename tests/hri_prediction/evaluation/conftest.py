"""Synthetic people: minimum-jerk reaches to two targets, with scatter."""

import numpy as np
import pytest

from hri_prediction.evaluation.recordings import Recording, make_recording
from hri_prediction.prediction import PredictorConfig
from hri_prediction.tracks.segmentation import Reach
from hri_prediction.tracks.track import ArmTrack

TARGETS = {"left bin": np.array([-0.45, -0.25, -0.1]), "right bin": np.array([-0.45, 0.25, -0.1])}
HOME = np.array([-0.2, 0.0, -0.35])
SHOULDER = np.array([0.7, 0.2, 0.5])


def elbow_of(wrist: np.ndarray) -> np.ndarray:
    """A hanging elbow, 0.29 m from the shoulder and 0.26 m from the wrist (N, 3)."""
    distance = np.linalg.norm(wrist, axis=1, keepdims=True)
    axis = wrist / distance
    along = (0.29**2 - 0.26**2 + distance**2) / (2.0 * distance)
    down = axis * axis[:, 2:] - np.array([0.0, 0.0, 1.0])
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    return along * axis + np.sqrt(0.29**2 - along**2) * down


def make_recording_of(subject: str, task: str, trial: int) -> Recording:
    """0.3 s of rest, a reach of about a second, 0.3 s of rest; 100 Hz; time 0 at the onset."""
    rng = np.random.default_rng([len(subject), ord(subject[0]), len(task), trial])
    length = 1.0 + 0.08 * rng.standard_normal()
    time = np.arange(-0.3, length + 0.3, 0.01)
    z = np.clip(time / length, 0.0, 1.0)
    rise = (z**3 * (10.0 - 15.0 * z + 6.0 * z**2))[:, None]
    start = HOME + 0.005 * rng.standard_normal(3)
    wrist = start + rise * (TARGETS[task] + 0.01 * rng.standard_normal(3) - start)
    wrist[:, 2] += 0.05 * np.sin(np.pi * rise[:, 0])
    elbow = elbow_of(wrist)
    points = SHOULDER + np.stack([0.0 * wrist, elbow, wrist, 1.35 * wrist - 0.35 * elbow], axis=1)
    points += 0.0005 * rng.standard_normal(points.shape)
    track = ArmTrack(time, points, "right", subject, task, trial, "synthetic")
    return make_recording(track, PredictorConfig().segmentation, [Reach(0.0, length)])


@pytest.fixture(scope="session")
def recordings() -> list[Recording]:
    return [
        make_recording_of(subject, task, trial)
        for subject in ("ann", "bob")
        for task in TARGETS
        for trial in range(3)
    ]
