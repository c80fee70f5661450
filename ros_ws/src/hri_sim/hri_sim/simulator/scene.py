"""The MuJoCo model of a scenario: the one URDF, a table, boxes, targets and the people's arms.

The robot's collision shapes become capsules of the radii in the URDF. A person's arm is three
capsules on mocap bodies, placed and sized anew whenever the arm moves. Only the robot may touch
anything: people, table and boxes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import CAPSULE_NAMES, RobotModel
from hri_prediction.arm.geometry import ArmRadii
from hri_prediction.compiled import njit
from hri_prediction.errors import DataError
from hri_sim.scenario.schema import BoxSpec, Scenario, TableSpec

FloatArray = NDArray[np.float64]

LIMBS = ("upper_arm", "forearm", "hand")
"""Capsules of a person's arm, from the shoulder on."""
LONGEST_LIMB = 0.8
"""Longest limb that fits the bounding volumes of the compiled model [m]."""

# Who touches whom: a pair collides when a contype meets a conaffinity.
_ROBOT, _OTHERS = (1, 0), (0, 1)
_HIDDEN = np.array([0.0, 0.0, -50.0])
_LIMB_COLOURS = ((0.15, 0.45, 0.68, 1.0), (0.35, 0.64, 0.84, 1.0), (0.88, 0.70, 0.56, 1.0))


@dataclass(frozen=True)
class SceneConfig:
    """Physics of the scene that the URDF does not hold.

    Attributes:
        timestep: Step of the physics [s].
        damping: Viscous friction of every joint [N m s/rad].
        armature: Inertia of every motor, seen at the joint [kg m^2].
        contacts: Whether anything may touch.
        radii: Radii of a person's limbs.
        width: Widest picture that can be rendered [pixel].
        height: Tallest picture that can be rendered [pixel].
    """

    timestep: float = 0.001
    damping: float = 0.5
    armature: float = 0.1
    contacts: bool = True
    radii: ArmRadii = field(default_factory=ArmRadii)
    width: int = 1920
    height: int = 1080


@dataclass(frozen=True)
class Scene:
    """A compiled scene and where its parts are.

    Attributes:
        model: The MuJoCo model; robot joints are its only degrees of freedom, in the robot's order.
        table_geom: Id of the table.
        limb_geoms: Of every arm, ids of upper arm, forearm, hand (A, 3).
        limb_mocap: Mocap indices of the same (A, 3).
        arm_names: Names of the arms, in the order of the rows, see :attr:`.Scenario.arms`.
        radii: Radii of the limbs (3,) [m].
    """

    model: mujoco.MjModel
    table_geom: int
    limb_geoms: NDArray[np.intp]
    limb_mocap: NDArray[np.intp]
    arm_names: tuple[str, ...]
    radii: FloatArray

    def place_arm(self, data: mujoco.MjData, row: int, keypoints: FloatArray | None) -> None:
        """Move a person's arm, or hide it.

        Args:
            data: The state whose mocap poses are set; limb lengths go into the model.
            row: Row of the arm.
            keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m], or None to hide the arm.

        Raises:
            DataError: when a limb is longer than the scene allows.
        """
        mocap, geoms = self.limb_mocap[row], self.limb_geoms[row]
        if keypoints is None:
            data.mocap_pos[mocap] = _HIDDEN
            return
        longest = _place_limbs(
            # A copy: poses may be read-only, which to the compiler is a type of its own.
            np.array(keypoints, dtype=float, order="C"),
            mocap,
            geoms,
            data.mocap_pos,
            data.mocap_quat,
            self.model.geom_size,
        )
        if longest >= 0:
            length = float(np.linalg.norm(keypoints[longest + 1] - keypoints[longest]))
            raise DataError(
                f"{LIMBS[longest]} of {self.arm_names[row]} is {length:.3f} m long",
                expected=f"at most {LONGEST_LIMB} m",
            )


@njit
def _place_limbs(
    keypoints: FloatArray,
    mocap: NDArray[np.intp],
    geoms: NDArray[np.intp],
    positions: FloatArray,
    quaternions: FloatArray,
    sizes: FloatArray,
) -> int:
    """Middle, turn and half length of the three limbs; -1, or the limb that is too long."""
    for limb in range(3):
        length = 0.0
        for i in range(3):
            length += (keypoints[limb + 1, i] - keypoints[limb, i]) ** 2
        if length > LONGEST_LIMB**2:
            return limb
    for limb in range(3):
        x = keypoints[limb + 1, 0] - keypoints[limb, 0]
        y = keypoints[limb + 1, 1] - keypoints[limb, 1]
        z = keypoints[limb + 1, 2] - keypoints[limb, 2]
        length = math.sqrt(x * x + y * y + z * z)
        row = mocap[limb]
        sizes[geoms[limb], 1] = 0.5 * length
        for i in range(3):
            positions[row, i] = 0.5 * (keypoints[limb + 1, i] + keypoints[limb, i])
        # The shortest turn from the z axis to the limb; straight down, about x.
        w = math.sqrt(max(0.5 * (1.0 + z / length), 0.0)) if length > 1e-9 else 1.0
        down = w < 1e-6
        quaternions[row, 0] = 0.0 if down else w
        quaternions[row, 1] = 1.0 if down else -0.5 * y / (w * max(length, 1e-9))
        quaternions[row, 2] = 0.0 if down else 0.5 * x / (w * max(length, 1e-9))
        quaternions[row, 3] = 0.0
    return -1


def build_scene(robot: RobotModel, scenario: Scenario, config: SceneConfig | None = None) -> Scene:
    """Compile the scene of a scenario.

    Args:
        robot: The robot, whose URDF text is used.
        scenario: Table, targets and people.
        config: Physics.
    """
    config = config or SceneConfig()
    spec = mujoco.MjSpec.from_string(robot.urdf_text)
    spec.modelname = scenario.name
    spec.option.timestep = config.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    spec.visual.global_.offwidth, spec.visual.global_.offheight = config.width, config.height
    _robot_capsules(spec, config.contacts)
    for joint in spec.joints:
        joint.damping[:] = config.damping
        joint.armature = config.armature
    for name, effort in zip(robot.joint_names, robot.effort, strict=True):
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
        motor.ctrllimited = True
        motor.ctrlrange[:] = (-effort, effort)
    spec.body("lwr_tool").add_site(name="tool", size=[0.008] * 3, rgba=[0.1, 0.1, 0.1, 1.0])
    _add_box(spec, "table", scenario.table, (0.80, 0.74, 0.65, 1.0), config.contacts)
    for index, box in enumerate(scenario.obstacles):
        _add_box(spec, f"obstacle_{index}", box, (0.90, 0.55, 0.20, 1.0), config.contacts)
    for name, point in scenario.targets.items():
        spec.worldbody.add_site(
            name=f"target_{name}", pos=point, size=[0.015] * 3, rgba=[0.10, 0.60, 0.45, 0.9]
        )
    for name in scenario.arms:
        _add_arm(spec, name, config)
    _add_surroundings(spec, scenario)
    return _found(spec.compile(), scenario, config)


def _robot_capsules(spec: mujoco.MjSpec, contacts: bool) -> None:
    """Replace each cylinder with two spheres of the URDF by the capsule that it stands for."""
    for part in CAPSULE_NAMES:
        cylinder = spec.geom(f"{part}_cylinder")
        # Read everything before deleting: the spec's views die with the element.
        body, radius, half = cylinder.parent, float(cylinder.size[0]), float(cylinder.size[1])
        position, quaternion = np.array(cylinder.pos), np.array(cylinder.quat)
        for shape in ("cylinder", "start", "end"):
            spec.delete(spec.geom(f"{part}_{shape}"))
        body.add_geom(
            name=part,
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, half, 0.0],
            pos=position,
            quat=quaternion,
            mass=0.0,
            group=3,
            contype=_ROBOT[0] if contacts else 0,
            conaffinity=_ROBOT[1] if contacts else 0,
        )


def _add_box(
    spec: mujoco.MjSpec,
    name: str,
    box: TableSpec | BoxSpec,
    colour: tuple[float, float, float, float],
    contacts: bool,
) -> None:
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=box.center,
        size=[0.5 * length for length in box.size],
        rgba=colour,
        contype=_OTHERS[0] if contacts else 0,
        conaffinity=_OTHERS[1] if contacts else 0,
    )


def _add_arm(spec: mujoco.MjSpec, name: str, config: SceneConfig) -> None:
    for limb, radius, colour in zip(LIMBS, config.radii.array, _LIMB_COLOURS, strict=True):
        body = spec.worldbody.add_body(name=f"{name}/{limb}", mocap=True, pos=_HIDDEN)
        # Compiled at the longest size, so that all bounding volumes hold whatever length comes.
        body.add_geom(
            name=f"{name}/{limb}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, 0.5 * LONGEST_LIMB, 0.0],
            rgba=colour,
            contype=_OTHERS[0] if config.contacts else 0,
            conaffinity=_OTHERS[1] if config.contacts else 0,
        )


def _add_surroundings(spec: mujoco.MjSpec, scenario: Scenario) -> None:
    """Light, floor and background: nothing that anything can touch."""
    spec.visual.headlight.ambient[:] = (0.45, 0.45, 0.45)
    spec.visual.headlight.diffuse[:] = (0.25, 0.25, 0.25)
    spec.visual.headlight.specular[:] = (0.0, 0.0, 0.0)
    right = not scenario.persons or scenario.persons[0].side == "right"
    side = 1.0 if right else -1.0
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(0.9, 1.3 * side, 2.8),
        dir=(-0.25, -0.42 * side, -0.87),
        diffuse=(0.45, 0.45, 0.45),
    )
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.97, 0.97),
        rgb2=(0.86, 0.87, 0.88),
        width=64,
        height=384,
    )
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.0, 0.0, scenario.table.top - 0.7),
        size=(0.0, 0.0, 0.1),
        rgba=(0.88, 0.88, 0.89, 1.0),
        contype=0,
        conaffinity=0,
    )
    spec.worldbody.add_geom(
        name="pedestal",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        fromto=(0.0, 0.0, scenario.table.top - 0.7, 0.0, 0.0, 0.0),
        size=(0.1, 0.0, 0.0),
        rgba=(0.62, 0.63, 0.65, 1.0),
        contype=0,
        conaffinity=0,
    )


def _found(model: mujoco.MjModel, scenario: Scenario, config: SceneConfig) -> Scene:
    def geom(name: str) -> int:
        return int(model.geom(name).id)

    names = [[f"{arm}/{limb}" for limb in LIMBS] for arm in scenario.arms]
    limbs = np.array([[geom(name) for name in row] for row in names], dtype=np.intp).reshape(-1, 3)
    mocap = [[int(model.body(name).mocapid[0]) for name in row] for row in names]
    return Scene(
        model=model,
        table_geom=geom("table"),
        limb_geoms=limbs,
        limb_mocap=np.array(mocap, dtype=np.intp).reshape(-1, 3),
        arm_names=tuple(scenario.arms),
        radii=config.radii.array,
    )
