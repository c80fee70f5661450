"""How fast the simulator runs."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.simulation import STEP_NS, Simulation
from hri_sim.simulator.trajectory import JointTrajectory


@dataclass(frozen=True)
class SimulatorSpeed:
    """Result of :func:`measure_speed`.

    Attributes:
        realtime_factor: Simulated seconds a second, everything on.
        physics_factor: The same with physics and controllers alone.
        steps: Physics steps of each measurement.
    """

    realtime_factor: float
    physics_factor: float
    steps: int


def measure_speed(scenario: Scenario, seconds: float = 4.0) -> SimulatorSpeed:
    """Measure the real-time factor of a scenario without ROS.

    "Everything" is what the simulator node does: arms placed and clearances, contacts and tool read
    at 250 Hz, a new trajectory at 28 Hz, the heartbeat at 50 Hz, the robot in motion all the time.

    Args:
        scenario: The scene.
        seconds: Simulated time of each measurement [s].
    """
    simulation = Simulation(scenario)
    simulation.warm_up()
    steps = round(seconds * 1e9 / STEP_NS)
    begun = time.perf_counter()
    simulation.step(steps)
    physics = time.perf_counter() - begun
    simulation.reset()
    begun = time.perf_counter()
    for step in range(0, steps, 4):
        if step % 36 == 0:
            simulation.controller.accept(_swing(simulation))
        if step % 20 == 0:
            simulation.controller.chain.command(1.0, simulation.time_ns)
        simulation.step(4)
        for person in scenario.persons:
            simulation.set_arm(person.id, _waving_arm(person.shoulder, simulation.time_s))
        simulation.clearance()
        simulation.table_clearance()
        simulation.contacts()
        simulation.tool_position()
    everything = time.perf_counter() - begun
    return SimulatorSpeed(seconds / everything, seconds / physics, steps)


def _swing(simulation: Simulation) -> JointTrajectory:
    """The next 1.5 s of a slow swing about the start posture, ending at rest, 43 points."""
    t = np.linspace(0.0, 1.5, 43)
    phase = simulation.time_s + t
    fade = np.clip((1.5 - t) / 0.5, 0.0, 1.0)
    q = np.array(simulation.scenario.robot_start) + 0.2 * np.sin(phase)[:, None]
    qd = (0.2 * np.cos(phase) * fade)[:, None] * np.ones(7)
    qdd = (-0.2 * np.sin(phase) * fade)[:, None] * np.ones(7)
    return JointTrajectory(simulation.time_ns, simulation.robot.joint_names, t, q, qd, qdd)


def _waving_arm(shoulder: tuple[float, float, float], time_s: float) -> np.ndarray:
    offsets = np.array([[0.0, 0.0, 0.0], [-0.05, 0.1, -0.25], [-0.2, 0.0, -0.2], [-0.3, 0.0, -0.2]])
    offsets[2:, 1] += 0.1 * np.sin(3.0 * time_s)
    return np.array(shoulder) + offsets
