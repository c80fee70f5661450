"""What viewers show of a person: the arm now, and the tube of where it will be."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from hri_prediction.prediction.output import Prediction
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.time import to_time

TUBE_POINTS = 8
"""Ellipsoids along the predicted wrist path."""
_ARM = ColorRGBA(r=0.90, g=0.62, b=0.0, a=1.0)
_TUBE = ColorRGBA(r=0.34, g=0.71, b=0.91, a=0.35)


def arm_markers(prediction: Prediction, name: str) -> list[Marker]:
    """The arm of that name now, as a line strip through its keypoints."""
    marker = _marker(prediction, f"{name}/arm", 0, Marker.LINE_STRIP)
    marker.scale = Vector3(x=0.04, y=0.0, z=0.0)
    marker.color = _ARM
    marker.points = [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in prediction.mean[0]]
    return [marker]


def prediction_markers(prediction: Prediction, name: str) -> list[Marker]:
    """Spheres of two standard deviations (largest axis) along the predicted wrist path."""
    chosen = np.linspace(0, len(prediction.times_s) - 1, TUBE_POINTS).round().astype(int)
    covariance = prediction.covariance[chosen, 2]
    sigma = np.sqrt(np.linalg.eigvalsh(covariance)[:, -1].clip(min=0.0))
    markers = []
    for number, (index, spread) in enumerate(zip(chosen, sigma, strict=True)):
        marker = _marker(prediction, f"{name}/prediction", number, Marker.SPHERE)
        x, y, z = (float(value) for value in prediction.mean[index, 2])
        marker.pose.position = Point(x=x, y=y, z=z)
        size = float(max(4.0 * spread, 0.01))
        marker.scale = Vector3(x=size, y=size, z=size)
        marker.color = _TUBE
        markers.append(marker)
    return markers


def _marker(prediction: Prediction, namespace: str, number: int, kind: int) -> Marker:
    marker = Marker(
        header=Header(stamp=to_time(prediction.stamp_ns), frame_id=WORLD),
        ns=namespace,
        id=number,
        type=kind,
        action=Marker.ADD,
    )
    marker.pose.orientation.w = 1.0
    marker.lifetime.nanosec = 500_000_000
    return marker
