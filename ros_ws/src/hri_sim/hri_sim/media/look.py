"""Colours (Okabe and Ito's palette, safe for the colour-blind) and shapes of picture and video."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_prediction.arm.geometry import ArmRadii
from hri_sim.media.raycast import Camera, Capsules
from hri_sim.people.arm import SHOULDER_BREADTH
from hri_sim.scenario.schema import PersonSpec, Scenario

FloatArray = NDArray[np.float64]
Colour = tuple[float, float, float]

BLUE: Colour = (0.0, 0.447, 0.698)
SKY: Colour = (0.337, 0.706, 0.914)
VERMILION: Colour = (0.835, 0.369, 0.0)
GREEN: Colour = (0.0, 0.62, 0.451)
PURPLE: Colour = (0.80, 0.475, 0.655)
GREY: Colour = (0.45, 0.45, 0.47)
ROBOT_PARTS: tuple[Colour, ...] = ((0.10, 0.42, 0.66), (0.26, 0.58, 0.80), (0.22, 0.25, 0.30))
PEDESTAL: Colour = (0.62, 0.63, 0.65)
TORSO: Colour = (0.80, 0.79, 0.77)
LIMBS: tuple[Colour, ...] = ((0.80, 0.42, 0.14), (0.90, 0.60, 0.34), (0.93, 0.70, 0.48))

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "0.35",
    "axes.linewidth": 0.8,
    "xtick.color": "0.25",
    "ytick.color": "0.25",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}
"""Of matplotlib."""
TUBE_M = 0.3
"""Predictions are drawn as far as two standard deviations are within this [m]."""


def robot_shape(robot: RobotModel, q: FloatArray) -> Capsules:
    """Pedestal, base and the three capsules of the robot in a posture (7,) [rad]."""
    points = robot.frames(q)
    pedestal = np.array([[[0.0, 0.0, -0.8], [0.0, 0.0, -0.06]], [[0.0, 0.0, 0.0], points[0]]])
    ends = np.concatenate((pedestal, np.stack((points[:-1], points[1:]), axis=1)))
    radii = np.concatenate(([0.10, 0.075], robot.capsule_radii))
    return Capsules(ends, radii, np.array((PEDESTAL, PEDESTAL, *ROBOT_PARTS)))


def torso_shape(person: PersonSpec) -> Capsules:
    """Head and trunk of a seated person, for orientation only: they are no obstacles."""
    inwards = 0.5 * (SHOULDER_BREADTH if person.side == "right" else -SHOULDER_BREADTH)
    x, y, z = person.shoulder[0] + 0.06, person.shoulder[1] - inwards, person.shoulder[2]
    ends = np.array(
        [
            [[x, y - 0.10, z - 0.06], [x, y + 0.10, z - 0.06]],
            [[x + 0.02, y, z - 0.12], [x + 0.02, y, z - 0.50]],
            [[x, y, z + 0.02], [x, y, z + 0.12]],
            [[x - 0.01, y, z + 0.20], [x - 0.01, y, z + 0.25]],
        ]
    )
    radii = np.array([0.085, 0.14, 0.05, 0.09])
    return Capsules(ends, radii, np.tile(TORSO, (4, 1)))


def tube_shown(mean: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The part of a predicted path that is worth drawing: as far as its region is not vast.

    Args:
        mean: Points of the path (K, 3) [m].
        sigma: Standard deviations (K,) [m].

    Returns:
        Points and radii of two standard deviations of those before the first wider than ``TUBE_M``.
    """
    wide = 2.0 * sigma > TUBE_M
    count = int(np.argmax(wide)) if wide.any() else len(wide)
    return mean[:count], 2.0 * sigma[:count]


def tube_shape(mean: FloatArray, sigma: FloatArray) -> Capsules:
    """A predicted path as a tube of two standard deviations; arguments as :func:`tube_shown`."""
    points, radii = tube_shown(mean, sigma)
    return Capsules.along(points, np.maximum(radii, 0.008), PURPLE)


def arm_shape(arm: FloatArray) -> Capsules:
    """The three limbs of an arm (4, 3) [m]; nothing of what is NaN."""
    ends = np.stack((arm[:-1], arm[1:]), axis=1)
    seen = np.isfinite(ends).all(axis=(1, 2))
    return Capsules(ends[seen], ArmRadii().array[seen], np.array(LIMBS)[seen])


def target_shape(points: FloatArray) -> Capsules:
    """Green balls at goals (n, 3) [m]."""
    ends = np.stack((points, points), axis=1)
    return Capsules(ends, np.full(len(points), 0.018), np.tile(GREEN, (len(points), 1)))


def camera_for(scenario: Scenario, fov: float = 0.54) -> Camera:
    """A view from the side of the first person's reaching arm, so that no trunk hides it."""
    side = -1.0 if scenario.persons and scenario.persons[0].side == "left" else 1.0
    return Camera((1.00, side * 1.75, 1.22), (0.40, side * 0.02, 0.27), fov)
