"""The robot model as the planner needs it, read from the URDF that everything else reads too."""

from __future__ import annotations

import functools
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.kinematics import many_arm_points
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

JOINT_NAMES = tuple(f"lwr_joint_{number}" for number in range(1, 8))
CAPSULE_NAMES = ("upper_arm", "lower_arm", "hand")
_AXES = ((0, 0, 1), (0, -1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1))


@dataclass(frozen=True)
class RobotModel:
    """LWR4+: limits, capsules and lengths. Arrays are read-only.

    Attributes:
        joint_names: Seven names, base to flange.
        lower: Lowest joint angles (7,) [rad].
        upper: Highest joint angles (7,) [rad].
        velocity: Largest joint speeds (7,) [rad/s].
        effort: Largest joint torques (7,) [N m].
        lengths: Height of the shoulder, shoulder to elbow, elbow to wrist, wrist to tool (4,) [m].
        capsule_radii: Of upper arm, lower arm and hand (3,) [m].
        part_masses: Of upper arm, lower arm and hand (3,) [kg], for the effort cost.
        urdf_text: The whole URDF.
    """

    joint_names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    effort: FloatArray
    lengths: FloatArray
    capsule_radii: FloatArray
    part_masses: FloatArray
    urdf_text: str = field(repr=False)

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("lower", "upper", "velocity", "effort", "lengths", "capsule_radii"):
            getattr(self, name).setflags(write=False)
        self.part_masses.setflags(write=False)

    @property
    def shoulder(self) -> FloatArray:
        """Centre of the shoulder (3,) [m], base frame."""
        return np.array([0.0, 0.0, self.lengths[0]])

    @property
    def reach(self) -> float:
        """Largest distance of the tool from the shoulder [m]."""
        return float(self.lengths[1:].sum())

    def frames(self, q: FloatArray) -> FloatArray:
        """Shoulder, elbow, wrist and tool.

        Args:
            q: Joint angles (..., 7) [rad].

        Returns:
            Points (..., 4, 3) [m], base frame.
        """
        angles = np.asarray(q, dtype=float)
        flat = np.ascontiguousarray(angles.reshape(-1, 7))
        points: FloatArray = many_arm_points(flat, self.lengths)
        return points.reshape(*angles.shape[:-1], 4, 3)

    def robot_capsules(self, q: FloatArray) -> FloatArray:
        """Capsule axes (..., 3, 2, 3) [m] of upper arm, lower arm and hand; see :meth:`frames`."""
        points = self.frames(q)
        return np.stack((points[..., :-1, :], points[..., 1:, :]), axis=-2)

    def within_limits(self, q: FloatArray, tolerance: float = 0.0) -> bool:
        """Whether all angles (..., 7) lie within the joint limits."""
        return bool(np.all(q >= self.lower - tolerance) and np.all(q <= self.upper + tolerance))


def capsule_radii(urdf_text: str) -> FloatArray:
    """Radii of the robot's capsules, upper arm, lower arm and hand.

    Args:
        urdf_text: A URDF in which capsule ``<part>`` is a cylinder and two spheres of one radius.

    Returns:
        (3,) [m].

    Raises:
        DataError: when a part is missing or its three shapes differ in radius.
    """
    shapes = {}
    for collision in ElementTree.fromstring(urdf_text).iter("collision"):
        geometry = collision.find("geometry")
        if geometry is not None and len(geometry):
            shapes[collision.get("name", "")] = float(geometry[0].get("radius", "nan"))
    radii = []
    for part in CAPSULE_NAMES:
        found = {shapes.get(f"{part}_{shape}") for shape in ("cylinder", "start", "end")}
        radius = found.pop()
        if found or radius is None:
            raise DataError(
                f"URDF capsule {part} is incomplete",
                expected="a cylinder and two spheres of one radius",
            )
        radii.append(radius)
    return np.array(radii)


def parse_robot(urdf_text: str) -> RobotModel:
    """Read the model from URDF text.

    Raises:
        DataError: when the text is no URDF or not one of this arm (joints, axes, straight links).
    """
    try:
        root = ElementTree.fromstring(urdf_text)
    except ElementTree.ParseError as error:
        raise DataError(f"URDF cannot be read: {error}") from error
    joints = {joint.get("name"): joint for joint in root.iter("joint")}
    limits = np.empty((4, 7))
    heights = np.empty(7)
    for index, name in enumerate(JOINT_NAMES):
        if name not in joints:
            raise DataError(f"URDF lacks {name}", expected=", ".join(JOINT_NAMES))
        axis = _vector(joints[name], "axis")
        if tuple(axis) != _AXES[index]:
            raise DataError(f"axis of {name} is {axis}", expected=str(_AXES[index]))
        heights[index] = _height(joints[name], name)
        limit = joints[name].find("limit")
        if limit is None:
            raise DataError(f"{name} has no limits")
        keys = ("lower", "upper", "velocity", "effort")
        limits[:, index] = [float(limit.get(key, "nan")) for key in keys]
    if "lwr_tool_joint" not in joints:
        raise DataError("URDF lacks lwr_tool_joint")
    offset = _height(joints["lwr_tool_joint"], "lwr_tool_joint")
    lengths = np.array(
        [
            heights[0] + heights[1],
            heights[2] + heights[3],
            heights[4] + heights[5],
            heights[6] + offset,
        ]
    )
    masses = {
        link.get("name"): float(mass.get("value", "nan"))
        for link in root.iter("link")
        if (mass := link.find("inertial/mass")) is not None
    }
    parts = [sum(masses[f"lwr_link_{n}"] for n in pair) for pair in ((2, 3), (4, 5), (6, 7))]
    lower, upper, velocity, effort = limits.copy()
    return RobotModel(
        joint_names=JOINT_NAMES,
        lower=lower,
        upper=upper,
        velocity=velocity,
        effort=effort,
        lengths=lengths,
        capsule_radii=capsule_radii(urdf_text),
        part_masses=np.array(parts),
        urdf_text=urdf_text,
    )


@functools.cache
def load_robot() -> RobotModel:
    """The LWR4+ that ships with this package."""
    text = resources.files("hri_planner.robot").joinpath("lwr4plus.urdf").read_text()
    return parse_robot(text)


def _vector(joint: ElementTree.Element, tag: str) -> tuple[float, ...]:
    element = joint.find(tag)
    if element is None:
        raise DataError(f"{joint.get('name')} has no {tag}")
    return tuple(float(v) for v in element.get("xyz", "0 0 0").split())


def _height(joint: ElementTree.Element, name: str) -> float:
    """Offset of a joint along z; anything else is not this arm."""
    x, y, z = _vector(joint, "origin")
    if x != 0.0 or y != 0.0:
        raise DataError(f"{name} is offset by ({x}, {y}) in x and y", expected="(0, 0)")
    return z
