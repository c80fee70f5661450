"""The smallest distance to whatever there is."""

import numpy as np
import pytest

from hri_planner.pibb.nearness import Nearness
from hri_planner.robot.model import load_robot

ROBOT = load_robot()
POSTURE = np.array((0.0, -0.1376, 0.0, 1.9745, 0.0, -1.0, 0.0))


def beyond_the_tool(gap: float) -> np.ndarray:
    """A small box in front of the tool, away from the base."""
    tool = ROBOT.frames(POSTURE)[3]
    half = np.full(3, 0.01)
    return np.array([[tool + np.array((half[0] + gap, 0.0, 0.0)), half]])


def test_it_is_of_what_is_nearest_whenever_that_was() -> None:
    near = Nearness(ROBOT, beyond_the_tool(0.2))
    assert near.distance == np.inf
    near.take(POSTURE, 0.5)
    solid = near.distance
    assert solid == pytest.approx(0.2 - ROBOT.capsule_radii[2], abs=1e-6)
    near.take(POSTURE, 0.05)
    assert near.distance == 0.05
    near.take(POSTURE, 0.5)
    assert near.distance == 0.05


def test_without_people_and_solids_it_is_infinite() -> None:
    near = Nearness(ROBOT, np.zeros((0, 2, 3)))
    near.take(POSTURE, np.inf)
    assert near.distance == np.inf
