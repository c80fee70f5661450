"""What is found of the numbers of a message."""

from __future__ import annotations

import math

from geometry_msgs.msg import Point
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

from hri_prediction.ros.messages import HumanArm
from hri_sim.testing.messages import numbers


def bad(message: object) -> list[str]:
    return [name for name, value in numbers(message, "m") if not math.isfinite(value)]


def test_numbers_that_are_none_are_found_wherever_they_are() -> None:
    assert bad(Float64(data=math.nan)) == ["m.data"]
    assert bad(JointState(name=["a"], position=[0.0, math.inf])) == ["m.position"]
    arm = HumanArm()
    arm.keypoints[5] = math.nan
    assert bad(arm) == ["m.keypoints"]
    point = JointTrajectoryPoint(positions=[1.0], velocities=[-math.inf])
    assert bad(JointTrajectory(points=[point])) == ["m.points.velocities"]
    marker = Marker(points=[Point(x=0.0), Point(z=math.nan)])
    marker.pose.orientation.w = math.nan
    found = bad(MarkerArray(markers=[Marker(), marker]))
    assert found == ["m.markers.pose.orientation.w", "m.markers.points.z"]


def test_what_is_finite_is_no_fault() -> None:
    assert bad(JointState(name=["a"], position=[1.0])) == []
    assert numbers(JointTrajectory(joint_names=["a"]), "m") == []
    assert numbers(Float64(data=2.0), "m") == [("m.data", 2.0)]
