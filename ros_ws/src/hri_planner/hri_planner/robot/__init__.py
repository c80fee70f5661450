"""The KUKA LWR4+: its model, forward kinematics and inverse kinematics."""

from hri_planner.robot.ik import ik_candidates, solve_ik
from hri_planner.robot.model import RobotModel, load_robot

__all__ = ["RobotModel", "ik_candidates", "load_robot", "solve_ik"]
