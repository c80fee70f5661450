"""Pinocchio with coal, and PyTorch, in the task of the kernel, where they are installed.

Pinocchio and coal are among the requirements for tests (``requirements/dev.txt``); PyTorch is none at all.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.benchmarks.plain_distances import row_gaps, row_points
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import DataError

Array = NDArray[np.float64]


def available(name: str) -> bool:
    """Whether a package can be imported."""
    try:
        importlib.import_module(name)
    except ImportError:
        return False
    return True


class PinocchioLoop:
    """Forward kinematics and nine capsule distances, configuration by configuration.

    All is C++ but the loop: Pinocchio's geometry model holds the robot's capsules, moved by its joints, and
    the person's, which are placed before each call.

    Args:
        robot: The robot.
        arm: Points of a person's arm (P, 4, 3) [m] at the columns, of constant limb lengths.
        human_radii: Of its capsules (3,) [m].

    Raises:
        DataError: when limbs change their lengths, since a shape of coal cannot.
    """

    def __init__(self, robot: RobotModel, arm: Array, human_radii: Array) -> None:
        import coal
        import pinocchio

        self._pinocchio = pinocchio
        self.model = pinocchio.buildModelFromXML(robot.urdf_text)
        self.data = self.model.createData()
        geometry = pinocchio.GeometryModel()
        # Upper arm, lower arm and hand begin in the joints 2, 4 and 6, along z at the zero posture.
        pinocchio.forwardKinematics(self.model, self.data, np.zeros(7))
        points = robot.frames(np.zeros(7))
        for part, name in enumerate(("lwr_joint_2", "lwr_joint_4", "lwr_joint_6")):
            joint = self.model.getJointId(name)
            middle = pinocchio.SE3(np.eye(3), 0.5 * (points[part] + points[part + 1]))
            placement = self.data.oMi[joint].inverse() * middle
            shape = coal.Capsule(robot.capsule_radii[part], robot.lengths[part + 1])
            geometry.addGeometryObject(
                pinocchio.GeometryObject(f"robot {part}", joint, placement, shape)
            )
        axes = np.diff(arm, axis=1)
        lengths = np.linalg.norm(axes, axis=2)
        if np.ptp(lengths, axis=0).max() > 1e-9:
            raise DataError("limbs change their lengths", expected="constant ones")
        for limb in range(3):
            shape = coal.Capsule(human_radii[limb], lengths[0, limb])
            geometry.addGeometryObject(
                pinocchio.GeometryObject(f"human {limb}", 0, pinocchio.SE3.Identity(), shape)
            )
        for part in range(3):
            for limb in range(3):
                geometry.addCollisionPair(pinocchio.CollisionPair(part, 3 + limb))
        self.geometry, self.placed = geometry, geometry.createData()
        self._placements = [
            [self._along(arm[column, limb], axes[column, limb]) for limb in range(3)]
            for column in range(len(arm))
        ]

    def _along(self, start: Array, axis: Array) -> Any:
        """Pose in the middle of a limb whose z axis is the limb's."""
        turn = self._pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), axis)
        return self._pinocchio.SE3(turn.toRotationMatrix(), start + 0.5 * axis)

    def gaps(self, q: Array) -> Array:
        """Distances (n, P, 9), robot's part by limb, of configurations (n, P, 7)."""
        found = np.empty((*q.shape[:2], 9))
        compute, humans = self._pinocchio.computeDistances, self.geometry.geometryObjects
        humans = [humans[3 + limb] for limb in range(3)]
        results = self.placed.distanceResults
        for column, placements in enumerate(self._placements):
            for limb in range(3):
                humans[limb].placement = placements[limb]
            for index in range(len(q)):
                compute(self.model, self.data, self.geometry, self.placed, q[index, column])
                found[index, column] = [result.min_distance for result in results]
        return found


class TorchRows:
    """The distances of :func:`row_gaps` on PyTorch tensors, one thread, float64.

    Args:
        robot: The robot.
        q: Configurations (n, P, 7) [rad].
        arm: Points of a person's arm (P, 4, 3) [m].
        human_radii: Of its capsules (3,) [m].
    """

    def __init__(self, robot: RobotModel, q: Array, arm: Array, human_radii: Array) -> None:
        self._torch: Any = importlib.import_module("torch")
        self._torch.set_num_threads(1)
        tensor = self._torch.as_tensor
        self._robot, self._human_radii = robot, human_radii
        self._q = [tensor(np.ascontiguousarray(q[..., joint])) for joint in range(6)]
        self._arm: Sequence[Sequence[Any]] = [
            [tensor(np.ascontiguousarray(arm[:, point, axis])) for axis in range(3)]
            for point in range(4)
        ]

    def gaps(self) -> list[list[tuple[Any, Any]]]:
        """Distances and places by robot's part and limb."""
        robot = self._robot
        points = row_points(self._q, robot.lengths.tolist(), self._torch)
        return row_gaps(
            points, robot.capsule_radii.tolist(), self._arm, self._human_radii.tolist(), self._torch
        )
