"""How the three joint angles turn the arm: order of rotations and axis of the elbow."""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.errors import ConfigError

JOINTS = ("shoulder elevation", "shoulder yaw", "elbow")
"""What q1, q2, q3 are, in this order wherever joint angles are arrays (..., 3) [rad]."""


@dataclass(frozen=True)
class Convention:
    """Order and axes of the three rotations, from the trunk to the forearm.

    Frame of the arm model: origin in the shoulder, z up; for a right arm x to the person's right and y to
    the front, for a left arm x to the left (mirrored). At q = 0 the arm is stretched out along x. A
    positive rotation about y lowers the arm, one about z turns it to the front.

    Attributes:
        name: Of the convention.
        joints: Which angle each rotation takes, by its index in q.
        axes: About which axis of the frame that the rotations before it have turned: "y", "z", or the
            other way round "-y".
    """

    name: str
    joints: tuple[int, int, int]
    axes: tuple[str, str, str]


YAW_PITCH = Convention("yaw_pitch", (1, 0, 2), ("z", "y", "z"))
"""p = Rz(q2) Ry(q1) [l_u x + Rz(q3) l_f x]: yaw outermost, elbow in the yaw plane. The thesis leaves both
open; its prose (section 2.3.1) has the height of the hand set by q1 and q2 interchangeable with q3, which
this is."""
PITCH_YAW = Convention("pitch_yaw", (0, 1, 2), ("y", "z", "z"))
"""p = Ry(q1) Rz(q2) [l_u x + Rz(q3) l_f x]: a plane that is raised and lowered as a whole."""
YAW_PITCH_ELBOW_PITCH = Convention("yaw_pitch_elbow_pitch", (1, 0, 2), ("z", "y", "-y"))
"""p = Rz(q2) Ry(q1) [l_u x + Ry(-q3) l_f x] with the elbow in the vertical plane of the
arm: flexion raises the forearm."""

CONVENTIONS = {each.name: each for each in (YAW_PITCH, PITCH_YAW, YAW_PITCH_ELBOW_PITCH)}


def convention_of(name: str) -> Convention:
    """The convention of a name.

    Raises:
        ConfigError: there is none; the names are listed.
    """
    if name not in CONVENTIONS:
        raise ConfigError(f"convention {name!r}", expected="one of " + ", ".join(CONVENTIONS))
    return CONVENTIONS[name]
