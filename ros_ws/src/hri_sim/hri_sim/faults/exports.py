"""Recordings of an arm as motion capture programs export them, made here so that they can be damaged."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MARKERS = ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")
JOINTS = ("RightArm", "RightForeArm", "RightHand")
FRAMES, RATE_HZ = 40, 100
OFFSETS_MM = ((-100.0, 0.0, 0.0), (-300.0, 0.0, 0.0), (-250.0, 0.0, 0.0), (-90.0, 0.0, 0.0))
"""Of the joints, and of the end of the hand, from the one before."""
BLOCK = 512
"""C3D files consist of blocks [bytes]."""


def arm_mm(rng: np.random.Generator) -> FloatArray:
    """An arm that moves smoothly, z up [mm] (frames, markers, 3)."""
    rest = np.array(
        [
            (0.0, 10.0, 1400.0),
            (20.0, 250.0, 1250.0),
            (40.0, 480.0, 1200.0),
            (0.0, 480.0, 1210.0),
            (10.0, 570.0, 1190.0),
        ]
    )
    phase = np.linspace(0.0, 1.0, FRAMES)[:, None, None]
    return rest + phase * rng.uniform(-100.0, 100.0, 3) + rng.normal(0.0, 0.5, (FRAMES, 5, 3))


def _rows(points: FloatArray, separator: str, leads: Iterable[Sequence[str]]) -> str:
    values = points.reshape(len(points), -1)
    return "".join(
        separator.join([*lead, *(f"{value:.6f}" for value in row)]) + "\n"
        for lead, row in zip(leads, values, strict=True)
    )


def _clock() -> list[tuple[str, str]]:
    return [(str(n + 1), f"{n / RATE_HZ:.5f}") for n in range(FRAMES)]


def trc(points: FloatArray) -> bytes:
    """As Motion Analysis and OpenSim write it, in millimetres."""
    counts = (RATE_HZ, RATE_HZ, FRAMES, len(MARKERS), "mm", RATE_HZ, 1, FRAMES)
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    axes = [f"{axis}{n}" for n in range(1, len(MARKERS) + 1) for axis in "XYZ"]
    head = (
        "PathFileType\t4\t(X/Y/Z)\ta.trc\n"
        + "\t".join([*keys.split(), "OrigNumFrames\n"])
        + "\t".join(map(str, counts))
        + "\nFrame#\tTime\t"
        + "\t\t\t".join(MARKERS)
        + "\t\t\n\t\t"
        + "\t".join(axes)
        + "\n\n"
    )
    return (head + _rows(points, "\t", _clock())).encode()


def vicon_csv(points: FloatArray) -> bytes:
    """The trajectories of a Nexus export, in millimetres."""
    count = len(MARKERS)
    head = (
        f"Trajectories\n{RATE_HZ}\n,,{',,,'.join(MARKERS)},,\n"
        f"Frame,Sub Frame{',X,Y,Z' * count}\n,{',mm' * (3 * count)}\n"
    )
    leads = [(str(n + 1), "0") for n in range(FRAMES)]
    return (head + _rows(points, ",", leads) + "\n").encode()


def qtm_tsv(points: FloatArray) -> bytes:
    """As QTM writes it, in millimetres."""
    columns = [f"{name} {axis}" for name in MARKERS for axis in "XYZ"]
    head = (
        f"NO_OF_FRAMES\t{FRAMES}\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t{len(MARKERS)}\n"
        f"FREQUENCY\t{RATE_HZ}\nDATA_INCLUDED\t3D\n"
        + "\t".join(["MARKER_NAMES", *MARKERS])
        + "\n"
        + "\t".join(["Frame", "Time", *columns])
        + "\n"
    )
    return (head + _rows(points, "\t", _clock())).encode()


def bvh(angles: FloatArray, scale: float = 1.0) -> bytes:
    """A skeleton of one arm; it names no unit.

    Args:
        angles: Of the joints (frames, 3, 3) [degree].
        scale: Its lengths are so many millimetres.
    """
    offsets = [" ".join(f"{scale * value:.6f}" for value in offset) for offset in OFFSETS_MM]
    head = (
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n"
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    )
    for name, offset in zip(JOINTS, offsets, strict=False):
        head += f"JOINT {name}\n{{\nOFFSET {offset}\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
    head += f"End Site\n{{\nOFFSET {offsets[-1]}\n" + "}\n" * (len(JOINTS) + 2)
    head += f"MOTION\nFrames: {FRAMES}\nFrame Time: {1.0 / RATE_HZ}\n"
    root = np.zeros((FRAMES, 2, 3))
    root[:, 0, 1] = 1000.0 * scale
    return (head + _rows(np.concatenate((root, angles), axis=1), " ", [()] * FRAMES)).encode()


def c3d(points: FloatArray) -> bytes:
    """Real numbers of an Intel processor, in millimetres, without analogue channels."""
    count, data_block = len(MARKERS), 4

    def entry(group: int, name: str, body: bytes) -> bytes:
        head = struct.pack("<bb", len(name), group) + name.encode()
        return head + struct.pack("<h", len(body) + 2) + body

    def parameter(name: str, kind: int, sizes: Sequence[int], data: bytes) -> bytes:
        return entry(1, name, struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + data + b"\0")

    width = len(MARKERS[0])
    entries = (
        entry(-1, "POINT", b"\0")
        + parameter("USED", 2, (), struct.pack("<h", count))
        + parameter("FRAMES", 2, (), struct.pack("<h", FRAMES))
        + parameter("DATA_START", 2, (), struct.pack("<h", data_block))
        + parameter("SCALE", 4, (), struct.pack("<f", -1.0))
        + parameter("RATE", 4, (), struct.pack("<f", RATE_HZ))
        + parameter("UNITS", -1, (2,), b"mm")
        + parameter("LABELS", -1, (width, count), "".join(MARKERS).encode())
    )
    header = struct.pack("<BB5hf2hf", 2, 0x50, count, 0, 1, FRAMES, 0, -1.0, data_block, 0, RATE_HZ)
    blocks = data_block - 2
    section = bytes([1, 0x50, blocks, 84]) + entries + b"\0\0"
    places = np.concatenate((points, np.zeros((FRAMES, count, 1))), axis=2)
    data = places.astype("<f4").tobytes()
    body = header.ljust(BLOCK, b"\0") + section.ljust(BLOCK * blocks, b"\0") + data
    return body + b"\0" * (-len(body) % BLOCK)


Export = Callable[[np.random.Generator, float], bytes]


def _of_markers(write: Callable[[FloatArray], bytes]) -> Export:
    return lambda rng, scale: write(scale * arm_mm(rng))


def _of_joints(rng: np.random.Generator, scale: float) -> bytes:
    phase = np.linspace(0.0, 1.0, FRAMES)[:, None, None]
    return bvh(phase * rng.uniform(-40.0, 40.0, (3, 3)), scale)


EXPORTS: dict[str, Export] = {
    "c3d": _of_markers(c3d),
    "trc": _of_markers(trc),
    "csv": _of_markers(vicon_csv),
    "tsv": _of_markers(qtm_tsv),
    "bvh": _of_joints,
}
"""By the ending of the file: one of lengths that are so many times those in millimetres."""
