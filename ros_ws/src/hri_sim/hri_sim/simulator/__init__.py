"""The simulated robot cell: MuJoCo scene, trajectory controller, simulation, baseline."""

from hri_sim.simulator.controller import ControllerConfig, TrajectoryController
from hri_sim.simulator.simulation import Clearance, Simulation, SimulatorConfig
from hri_sim.simulator.stopchain import StopChain, StopChainConfig
from hri_sim.simulator.trajectory import JointTrajectory

__all__ = [
    "Clearance",
    "ControllerConfig",
    "JointTrajectory",
    "Simulation",
    "SimulatorConfig",
    "StopChain",
    "StopChainConfig",
    "TrajectoryController",
]
