"""What viewers show of a plan: the path of the tool."""

from __future__ import annotations

from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from hri_planner.ptomp.plan import JointPlan
from hri_planner.robot.model import RobotModel
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.time import to_time


def plan_markers(plan: JointPlan, robot: RobotModel, stamp_ns: int) -> MarkerArray:
    """The tool's path as a line strip."""
    path = Marker(
        header=Header(stamp=to_time(stamp_ns), frame_id=WORLD),
        ns="plan",
        id=0,
        type=Marker.LINE_STRIP,
        action=Marker.ADD,
        scale=Vector3(x=0.01, y=0.0, z=0.0),
        color=ColorRGBA(r=0.0, g=0.62, b=0.45, a=1.0),
    )
    path.pose.orientation.w = 1.0
    tool = robot.frames(plan.q)[:, 3]
    path.points = [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in tool]
    return MarkerArray(markers=[path])
