"""BVH: a skeleton and the rotations of its joints (Biovision), by forward kinematics.

Each joint has an offset from its parent and channels. With column vectors, the rotation of a joint is
the product of its channels in the order of the file, below that of its parent; so a joint lies at

    p = p_parent + R_parent (offset or position channels),    R = R_parent R_1 R_2 R_3.

Position channels take the place of the offset, as the programs do that write them for every joint;
where those of an inner joint are zero throughout, the offset holds. y points up. There is no unit.
An end site is named after its joint: ``Hand_end``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError, cut
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.tables import is_number

_MOST_STIFF = 4
"""Joints and end sites for each channel: each of them has a place in each frame."""
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "xyz")


@dataclass
class Joint:
    """One joint of a skeleton.

    Attributes:
        name: Its name.
        parent: Row of its parent in the list of joints; -1 for a root.
        offset: From the parent, in its frame, shape (3,).
        channels: Names in lower case, in the order of the file.
        first: Column of its first channel in the motion.
    """

    name: str
    parent: int
    offset: FloatArray = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()
    first: int = 0


def is_bvh(text: str) -> bool:
    """Whether a text begins as BVH files do."""
    return text.lstrip()[:9].upper() == "HIERARCHY"


def read_bvh(text: str, source: str) -> MarkerData:
    """Read a BVH file: the places of its joints and end sites, in its own unit and axes.

    Raises:
        DataError: when the skeleton or the motion is malformed.
    """
    skeleton, found, motion = text.partition("MOTION")
    if not found:
        raise DataError("the BVH file has no line MOTION", expected="a skeleton and its motion")
    joints = parse_hierarchy(skeleton)
    columns = sum(len(joint.channels) for joint in joints)
    if len(joints) > _MOST_STIFF * columns:
        raise DataError(
            f"the BVH skeleton has {len(joints)} joints and ends for {columns} channels",
            expected="channels that move the joints",
        )
    period, values = _motion(motion, columns)
    return MarkerData(
        format="BVH",
        labels=unique_labels([joint.name for joint in joints]),
        positions=joint_positions(joints, values),
        frames=np.arange(1.0, len(values) + 1.0),
        rate_hz=1.0 / period,
        up="+y",
        up_fixed=True,
        zeros_missing=False,
        source=source,
    )


def parse_hierarchy(text: str) -> list[Joint]:
    """Joints of a skeleton, parents before their children.

    Raises:
        DataError: when the text is no skeleton.
    """
    words = text.split()
    joints: list[Joint] = []
    open_joints: list[int] = []
    columns = 0
    at = 1

    def take(count: int) -> list[str]:
        nonlocal at
        at += count
        if at > len(words):
            raise DataError("the BVH skeleton is cut off", expected="a } for every {")
        return words[at - count : at]

    while at < len(words):
        word = take(1)[0].upper()
        if word in ("ROOT", "JOINT", "END"):
            # A name may hold spaces: it ends where the brace opens.
            name = " ".join(iter(lambda: take(1)[0], "{"))
            parent = open_joints[-1] if open_joints else -1
            if (parent < 0) != (word == "ROOT"):
                raise DataError(
                    f"the BVH skeleton is bad: {word} {cut(name)} stands at a wrong place",
                    expected="ROOT outside of all joints, JOINT and End Site within one",
                )
            joints.append(Joint(f"{joints[parent].name}_end" if word == "END" else name, parent))
            open_joints.append(len(joints) - 1)
        elif word == "}" and open_joints:
            open_joints.pop()
        elif word == "OFFSET" and open_joints:
            joints[open_joints[-1]].offset = _numbers(take(3), "OFFSET")
        elif word == "CHANNELS" and open_joints:
            count = take(1)[0]
            counted = count.isascii() and count.isdigit() and len(count) < 3
            names = tuple(name.lower() for name in take(int(count) if counted else 0))
            unknown = [name for name in names if name not in _CHANNELS]
            if not counted or unknown or len(set(names)) != len(names):
                raise DataError(
                    f"the BVH skeleton is bad: CHANNELS {cut(count)} {cut(' '.join(names))}",
                    expected="a number and different names such as Zrotation",
                )
            joint = joints[open_joints[-1]]
            if joint.channels:
                raise DataError(
                    f"the BVH skeleton is bad: {cut(joint.name)} has CHANNELS twice",
                    expected="once",
                )
            joint.channels, joint.first = names, columns
            columns += len(names)
        else:
            raise DataError(
                f"the BVH skeleton is bad: {words[at - 1][:40]!r}",
                expected="ROOT, JOINT, End Site, OFFSET, CHANNELS or }",
            )
    if open_joints or not joints:
        raise DataError("the BVH skeleton is cut off", expected="a } for every {")
    return joints


def joint_positions(joints: list[Joint], values: FloatArray) -> FloatArray:
    """Forward kinematics.

    Args:
        joints: Parents before their children.
        values: Channels, shape (N, C): lengths, and angles [degree].

    Returns:
        Places of the joints, shape (N, len(joints), 3), in the frame and unit of the file.
    """
    count = len(values)
    positions = np.empty((count, len(joints), 3))
    rotations = np.empty((len(joints), count, 3, 3))
    for row, joint in enumerate(joints):
        inner = joint.parent >= 0
        above = rotations[joint.parent] if inner else np.broadcast_to(np.eye(3), (count, 3, 3))
        shift = np.broadcast_to(joint.offset, (count, 3)).copy()
        moved = [
            (column, "xyz".index(name[0]))
            for column, name in enumerate(joint.channels, start=joint.first)
            if name.endswith("position")
        ]
        if moved and not (inner and not values[:, [column for column, _ in moved]].any()):
            for column, axis in moved:
                shift[:, axis] = values[:, column]
        start = positions[:, joint.parent] if inner else np.zeros((count, 3))
        positions[:, row] = start + np.einsum("nij,nj->ni", above, shift)
        turned = above
        for column, name in enumerate(joint.channels, start=joint.first):
            if name.endswith("rotation"):
                turned = turned @ _rotation("xyz".index(name[0]), np.radians(values[:, column]))
        rotations[row] = turned
    return positions


def _rotation(axis: int, angle: FloatArray) -> FloatArray:
    """Rotations about a coordinate axis, shape (N, 3, 3)."""
    matrix = np.zeros((len(angle), 3, 3))
    one, two = (axis + 1) % 3, (axis + 2) % 3
    matrix[:, axis, axis] = 1.0
    matrix[:, one, one] = matrix[:, two, two] = np.cos(angle)
    matrix[:, two, one] = np.sin(angle)
    matrix[:, one, two] = -matrix[:, two, one]
    return matrix


def _motion(text: str, columns: int) -> tuple[float, FloatArray]:
    """Time between frames [s], and the channels, shape (N, columns)."""
    lines = [line for line in text.splitlines() if line.strip()]
    head = [line.partition(":") for line in lines[:2]]
    if len(head) < 2 or [key.strip().lower() for key, _, _ in head] != ["frames", "frame time"]:
        raise DataError("the BVH motion is bad", expected="Frames: and Frame Time: below MOTION")
    count, period = (_numbers([value], key)[0] for key, _, value in head)
    if not (math.isfinite(period) and period > 0.0):
        raise DataError(f"Frame Time: {period:g}", expected="a positive time in s")
    words = " ".join(lines[2:]).split()
    if len(words) != round(count) * columns:
        raise DataError(
            f"the BVH motion holds {len(words)} numbers",
            expected=f"{round(count) * columns}: {round(count)} frames of {columns} channels",
        )
    return float(period), _numbers(words, "the BVH motion").reshape(-1, columns)


def _numbers(words: list[str], where: str) -> FloatArray:
    wrong = next((word for word in words if not is_number(word)), None)
    if wrong is not None:
        raise DataError(f"{where} holds {wrong[:40]!r}", expected="numbers")
    numbers = np.array(words, dtype=np.float64)
    if not np.isfinite(numbers).all():
        raise DataError(f"{where} holds a number that is not finite", expected="finite numbers")
    return numbers
