"""The simulated cell in motion: physics, torque control, people's arms, true distances.

Each step of 1 ms: computed torque asks the motors for M (qdd_ref + Kp e + Kd ed) + bias - friction,
clipped at their limits, MuJoCo integrates, and the trajectory controller moves its reference on.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.robot.model import CAPSULE_NAMES, RobotModel, load_robot
from hri_prediction.compiled import njit
from hri_prediction.config import parameter
from hri_prediction.errors import DataError
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.controller import ControllerConfig, TrajectoryController
from hri_sim.simulator.distances import approach_speed, arm_clearance, table_clearance
from hri_sim.simulator.scene import LIMBS, SceneConfig, build_scene
from hri_sim.simulator.trajectory import JointTrajectory

FloatArray = NDArray[np.float64]

STEP_NS = 1_000_000
"""Step of the physics and of the torque control [ns]."""


@dataclass(frozen=True)
class SimulatorConfig(ControllerConfig):
    """Parameters of the simulated robot and its controllers."""

    bandwidth: float = parameter(
        40.0,
        "Natural frequency of the computed-torque loop; higher tracks more stiffly and hits harder",
        unit="rad/s",
        low=1.0,
        high=300.0,
    )
    damping_ratio: float = parameter(
        1.0, "Damping ratio of the computed-torque loop", low=0.1, high=5.0
    )
    joint_damping: float = parameter(
        0.5, "Viscous friction of every joint", unit="N m s/rad", low=0.0, high=50.0
    )
    armature: float = parameter(
        0.1, "Inertia of every motor, seen at the joint", unit="kg m^2", low=0.0, high=5.0
    )
    start_noise: float = parameter(
        0.0, "Standard deviation of the start posture about the scenario's", unit="rad", low=0.0
    )


@dataclass(frozen=True)
class Clearance:
    """Smallest signed surface distance between robot and people.

    Attributes:
        distance: [m]; negative where they overlap, infinite when nobody is in the scene.
        robot_part: Which robot capsule ("" when nobody is there).
        arm: Name of the arm, see :attr:`.Scenario.arms`.
        limb: Which limb of it.
        approach: How fast the robot's nearest point comes at the person's [m/s]; negative where it goes
            away, 0 when nobody is there.
    """

    distance: float
    robot_part: str
    arm: str
    limb: str
    approach: float


@njit
def _wanted_acceleration(
    q: FloatArray,
    qd: FloatArray,
    q_ref: FloatArray,
    qd_ref: FloatArray,
    qdd_ref: FloatArray,
    gains: FloatArray,
    out: FloatArray,
) -> None:
    for j in range(7):
        out[j] = qdd_ref[j] + gains[0] * (q_ref[j] - q[j]) + gains[1] * (qd_ref[j] - qd[j])


@njit
def _torque(
    inertial: FloatArray, bias: FloatArray, passive: FloatArray, effort: FloatArray, out: FloatArray
) -> None:
    for j in range(7):
        torque = inertial[j] + bias[j] - passive[j]
        out[j] = min(max(torque, -effort[j]), effort[j])


class Simulation:
    """Robot, table and people's arms of a scenario.

    Args:
        scenario: What is in the scene.
        contacts: Whether bodies push each other; without, they pass through.
        seed: Seed of the start posture's noise.
        config: Parameters.
        robot: The robot; the one that ships when not given.

    Attributes:
        controller: Give it trajectories, and heartbeats through ``controller.chain``.
        scene: The compiled scene; ``scene.model`` and :attr:`data` are MuJoCo's own.
        time_ns: Simulated time since the last reset [ns].
        q: Joint angles now (7,) [rad]; a view that follows the simulation.
        qd: Joint velocities now (7,) [rad/s]; a view.
        torque: Joint torques of the last step (7,) [N m]; a view.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        contacts: bool = True,
        seed: int = 0,
        config: SimulatorConfig | None = None,
        robot: RobotModel | None = None,
    ) -> None:
        self.scenario = scenario
        self.config = config or SimulatorConfig()
        self.robot = robot or load_robot()
        physics = SceneConfig(
            timestep=STEP_NS * 1e-9,
            damping=self.config.joint_damping,
            armature=self.config.armature,
            contacts=contacts,
        )
        self.scene = build_scene(self.robot, scenario, physics)
        self.data = mujoco.MjData(self.scene.model)
        self.controller = TrajectoryController(self.robot, self.config)
        self.q = self.data.qpos
        self.qd = self.data.qvel
        self.torque = self.data.ctrl
        frequency = self.config.bandwidth
        self._gains = np.array([frequency**2, 2.0 * self.config.damping_ratio * frequency])
        self._arms = np.full((len(self.scene.arm_names), 4, 3), np.nan)
        self._rows = {name: row for row, name in enumerate(self.scene.arm_names)}
        self._points, self._velocities = np.empty((4, 3)), np.empty((4, 3))
        self._accel = np.empty(7)
        self._inertial = np.empty(7)
        self._table_center = np.array(scenario.table.center)
        self._table_half = 0.5 * np.array(scenario.table.size)
        self.reset(seed)

    def reset(self, seed: int | None = None, q: ArrayLike | None = None) -> None:
        """Begin again at time 0, at rest, holding the start posture, with no arm in the scene.

        Args:
            seed: Seed of the start posture's noise; as before when not given.
            q: Start posture (7,) [rad]; the scenario's when not given.

        Raises:
            DataError: when the start posture is outside the joint limits.
        """
        if seed is not None:
            self._seed = seed
        posture = np.array(self.scenario.robot_start if q is None else q, dtype=float)
        if posture.shape != (7,) or not np.isfinite(posture).all():
            raise DataError(f"start posture {posture}", expected="7 finite joint angles [rad]")
        if not self.robot.within_limits(posture):
            low, high = self.robot.lower.round(3).tolist(), self.robot.upper.round(3).tolist()
            raise DataError(
                f"start posture {posture.round(3).tolist()} is outside the joint limits",
                expected=f"{low} to {high}",
            )
        if self.config.start_noise:
            rng = np.random.default_rng(self._seed)
            posture += self.config.start_noise * rng.standard_normal(7)
            posture = np.clip(posture, self.robot.lower, self.robot.upper)
        mujoco.mj_resetData(self.scene.model, self.data)
        self.q[:] = posture
        for name in self._rows:
            self.set_arm(name, None)
        self.time_ns = 0
        self.controller.reset(posture, 0)
        mujoco.mj_forward(self.scene.model, self.data)

    def warm_up(self) -> None:
        """Compile everything that a running simulation uses, then begin again at time 0."""
        here = np.tile(self.q, (2, 1))
        rest = np.zeros((2, 7))
        trajectory = JointTrajectory(
            0, self.robot.joint_names, np.array([0.1, 0.2]), here, rest, rest
        )
        self.controller.accept(trajectory)
        self.step(2)
        self.clearance()
        approach_speed(
            self.q, self.qd, self.robot.lengths, 0, np.ones((2, 3)), self._points, self._velocities
        )
        self.table_clearance()
        self.tool_position()
        self.reset()

    @property
    def time_s(self) -> float:
        """Simulated time since the last reset [s]."""
        return self.time_ns * 1e-9

    @property
    def arm_names(self) -> tuple[str, ...]:
        """Names of the arms that can be placed: see :attr:`.Scenario.arms`."""
        return self.scene.arm_names

    def set_arm(self, name: str, keypoints: ArrayLike | None) -> None:
        """Place a person's arm where it truly is.

        Args:
            name: Of the arm; that of the arm that reaches is the person's id.
            keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m], world frame; None: not there.

        Raises:
            DataError: on an unknown arm, a wrong shape, numbers that are not finite, or limbs
                longer than :data:`hri_sim.simulator.scene.LONGEST_LIMB`.
        """
        if name not in self._rows:
            raise DataError(
                f"there is no arm {name!r} in scenario {self.scenario.name!r}",
                expected=", ".join(self._rows) or "nobody",
            )
        row = self._rows[name]
        if keypoints is None:
            self._arms[row] = np.nan
            self.scene.place_arm(self.data, row, None)
            return
        points = np.asarray(keypoints, dtype=float)
        if points.shape != (4, 3) or not np.isfinite(points).all():
            raise DataError(
                f"the arm {name} has shape {points.shape}"
                + ("" if np.isfinite(points).all() else " and numbers that are not finite"),
                expected="(4, 3) finite positions [m]",
            )
        self.scene.place_arm(self.data, row, points)
        self._arms[row] = points

    def step(self, n: int = 1) -> None:
        """Advance by ``n`` steps of 1 ms."""
        model, data, controller = self.scene.model, self.data, self.controller
        q, qd, torque = self.q, self.qd, self.torque
        effort, bias, passive = self.robot.effort, data.qfrc_bias, data.qfrc_passive
        for _ in range(n):
            mujoco.mj_step1(model, data)
            _wanted_acceleration(
                q,
                qd,
                controller.q_ref,
                controller.qd_ref,
                controller.qdd_ref,
                self._gains,
                self._accel,
            )
            mujoco.mj_mulM(model, data, self._inertial, self._accel)
            _torque(self._inertial, bias, passive, effort, torque)
            mujoco.mj_step2(model, data)
            self.time_ns += STEP_NS
            # Last, so that outside of this loop references and joint angles are of one instant.
            controller.step(self.time_ns, q)

    def clearance(self) -> Clearance:
        """True distance between robot and people now, from the actual joint angles."""
        distance, part, row, limb = arm_clearance(
            self.q,
            self.robot.lengths,
            self.robot.capsule_radii,
            self._arms,
            self.scene.radii,
            self._points,
        )
        if row < 0:
            return Clearance(distance, "", "", "", 0.0)
        approach = approach_speed(
            self.q,
            self.qd,
            self.robot.lengths,
            part,
            self._arms[row, limb : limb + 2],
            self._points,
            self._velocities,
        )
        name = self.scene.arm_names[row]
        return Clearance(distance, CAPSULE_NAMES[part], name, LIMBS[limb], approach)

    def table_clearance(self) -> float:
        """True distance between robot and table now [m]."""
        return float(
            table_clearance(
                self.q,
                self.robot.lengths,
                self.robot.capsule_radii,
                self._table_center,
                self._table_half,
                self._points,
            )
        )

    def contacts(self) -> tuple[int, int]:
        """Number of contacts in the last step: robot with people, robot with table."""
        if self.data.ncon == 0:
            return 0, 0
        table = int((self.data.contact.geom == self.scene.table_geom).any(axis=1).sum())
        return int(self.data.ncon) - table, table

    def tool_position(self) -> FloatArray:
        """Tool centre point now (3,) [m], world frame."""
        tool: FloatArray = self.robot.frames(self.q)[3]
        return tool

    def arm(self, name: str) -> FloatArray | None:
        """Where an arm was placed (4, 3) [m]; None when hidden."""
        points = self._arms[self._rows[name]]
        return None if np.isnan(points[0, 0]) else points.copy()
