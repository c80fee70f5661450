"""Small motion capture files of every format, written as other programs write them."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

ARM = ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")
"""Plug-in Gait names of a right arm."""


def arm_mm(frames: int = 5, markers: Sequence[str] = ARM) -> np.ndarray:
    """Positions of the markers of an arm [mm], shape (frames, markers, 3), z up, all different."""
    rest = {
        "SHO": (0.0, 10.0, 1400.0),
        "ELB": (20.0, 250.0, 1250.0),
        "WRA": (40.0, 480.0, 1200.0),
        "WRB": (0.0, 480.0, 1210.0),
        "FIN": (10.0, 570.0, 1190.0),
    }
    points = np.array([rest[name[-3:]] for name in markers])
    steps = np.arange(frames)[:, None, None] * np.array([1.0, 3.0, -0.5])
    return points[None] + steps


def _text(value: float, missing: str | None) -> str:
    return f"{value:.6f}" if np.isfinite(value) else str(missing)


def trc_text(
    points: np.ndarray,
    labels: Sequence[str] = ARM,
    *,
    rate: str = "100",
    step: float = 0.01,
    units: str = "mm",
    separator: str = "\t",
    newline: str = "\n",
    missing: str = "",
    first: int = 1,
) -> str:
    """A TRC file."""
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame"
    counts = [rate, rate, str(len(points)), str(len(labels)), units, rate, str(first)]
    lines = [
        ["PathFileType", "4", "(X/Y/Z)", "a.trc"],
        [*keys.split(), "OrigNumFrames"],
        [*counts, str(len(points))],
        ["Frame#", "Time", *(cell for label in labels for cell in (label, "", ""))],
        ["", "", *(f"{axis}{i}" for i in range(1, len(labels) + 1) for axis in "XYZ")],
        [],
    ]
    for row, frame in enumerate(points):
        cells = [_text(value, missing) for value in frame.ravel()]
        lines.append([str(first + row), f"{row * step:.5f}", *cells])
    return newline.join(separator.join(cells) for cells in lines) + newline


def vicon_text(
    points: np.ndarray,
    labels: Sequence[str] = ARM,
    *,
    rate: str = "100",
    units: str = "mm",
    newline: str = "\n",
    missing: str = "",
    before: Sequence[str] = (),
    first: int = 1,
) -> str:
    """A Nexus export with a part Trajectories."""
    count = len(labels)
    lines = [
        *before,
        "Trajectories",
        rate,
        ",," + ",,,".join(labels) + ",,",
        "Frame,Sub Frame" + ",X,Y,Z" * count,
        "," + f",{units}" * (3 * count),
    ]
    for row, frame in enumerate(points):
        cells = [_text(value, missing) for value in frame.ravel()]
        lines.append(",".join([str(first + row), "0", *cells]))
    return newline.join([*lines, "", ""])


def qtm_text(
    points: np.ndarray,
    labels: Sequence[str] = ARM,
    *,
    rate: str = "100",
    header: bool = True,
    lead: bool = True,
    missing: str = "",
    end: str = "\t",
    first: int = 1,
) -> str:
    """A QTM export, with a line of column names or with MARKER_NAMES only."""
    lines = [
        f"NO_OF_FRAMES\t{len(points)}",
        "NO_OF_CAMERAS\t8",
        f"NO_OF_MARKERS\t{len(labels)}",
        f"FREQUENCY\t{rate}",
        "DATA_INCLUDED\t3D",
        "\t".join(["MARKER_NAMES", *labels]),
    ]
    if header:
        names = [f"{label} {axis}" for label in labels for axis in "XYZ"]
        lines.append("\t".join(["Frame", "Time", *names]))
    for row, frame in enumerate(points):
        cells = [_text(value, missing) for value in frame.ravel()]
        before = [str(first + row), f"{row / float(rate):.5f}"] if lead else []
        lines.append("\t".join([*before, *cells]) + end)
    return "\n".join(lines) + "\n"


# ------------------------------------------------------------------ C3D
def _vax(value: float) -> bytes:
    """A number in the floating point of a VAX: exponent shifted by two, halves exchanged."""
    bits = struct.pack("<f", value * 4.0)
    return bits[2:] + bits[:2]


def c3d_bytes(
    points: np.ndarray,
    labels: Sequence[str] = ARM,
    *,
    processor: str = "Intel",
    real: bool = True,
    rate: float = 100.0,
    units: str = "mm",
    y_screen: str = "",
    scale: float = 0.05,
    first: int = 1,
) -> bytes:
    """A C3D file without analogue channels; NaN becomes a residual of -1.

    Args:
        points: Shape (frames, markers, 3).
        labels: Names of the markers.
        processor: Intel, DEC or MIPS.
        real: Floating point instead of whole numbers.
        rate: Frames a second.
        units: POINT:UNITS.
        y_screen: POINT:Y_SCREEN; left away when empty.
        scale: Resolution of whole numbers.
        first: Number of the first frame.
    """
    end = ">" if processor == "MIPS" else "<"

    def short(*values: int) -> bytes:
        return struct.pack(f"{end}{len(values)}h", *values)

    def number(value: float) -> bytes:
        return _vax(value) if processor == "DEC" else struct.pack(f"{end}f", value)

    def entry(group: int, name: str, body: bytes) -> bytes:
        head = struct.pack("<bb", len(name), group) + name.encode()
        return head + short(len(body) + 2) + body

    def parameter(name: str, kind: int, sizes: Sequence[int], data: bytes) -> bytes:
        body = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + data + b"\x00"
        return entry(1, name, body)

    signed = -abs(scale) if real else scale
    width = max([len(label) for label in labels] + [1])
    names = "".join(label.ljust(width) for label in labels).encode()
    frames, count = points.shape[:2]
    entries = [
        entry(-1, "POINT", b"\x00"),
        parameter("USED", 2, (), short(count)),
        parameter("FRAMES", 2, (), short(frames)),
        parameter("DATA_START", 2, (), short(_data_block(count))),
        parameter("SCALE", 4, (), number(signed)),
        parameter("RATE", 4, (), number(rate)),
        parameter("UNITS", -1, (len(units),), units.encode()),
        parameter("LABELS", -1, (width, count), names),
    ]
    if y_screen:
        entries.append(parameter("Y_SCREEN", -1, (len(y_screen),), y_screen.encode()))
    blocks = _data_block(count) - 2
    kind = {"Intel": 84, "DEC": 85, "MIPS": 86}[processor]
    section = bytes([1, 0x50, blocks, kind]) + b"".join(entries) + b"\x00\x00"
    header = bytes([2, 0x50]) + short(count, 0, first, first + frames - 1, 0)
    header += number(signed) + short(_data_block(count), 0) + number(rate)
    data = []
    for point in points.reshape(-1, 3):
        seen = np.isfinite(point).all()
        values = [*point, 0.0] if seen else [0.0, 0.0, 0.0, -1.0]
        if real:
            data.append(b"".join(number(float(value)) for value in values))
        else:
            data.append(short(*(round(value / scale) for value in values[:3]), 0 if seen else -1))
    body = header.ljust(512, b"\x00") + section.ljust(512 * blocks, b"\x00") + b"".join(data)
    return body + b"\x00" * (-len(body) % 512)


def _data_block(count: int) -> int:
    return 5 + count // 20


# ------------------------------------------------------------------ BVH
BVH_SKELETON = """HIERARCHY
ROOT Hips
{
  OFFSET 1.0 2.0 3.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT RightShoulder
  {
    OFFSET -20.0 50.0 0.0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT RightArm
    {
      OFFSET -10.0 0.0 0.0
      CHANNELS 3 Yrotation Zrotation Xrotation
      JOINT RightForeArm
      {
        OFFSET -30.0 0.0 0.0
        CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT RightHand
        {
          OFFSET -25.0 0.0 0.0
          CHANNELS 3 Zrotation Xrotation Yrotation
          End Site
          {
            OFFSET -9.0 0.0 0.0
          }
        }
      }
    }
  }
}
"""
"""A right arm in cm, as MotionBuilder names it: its RightShoulder is the collar bone."""


def bvh_text(values: np.ndarray, *, period: float = 0.01, newline: str = "\n") -> str:
    """A BVH file of :data:`BVH_SKELETON`; values of shape (frames, 18)."""
    lines = [*BVH_SKELETON.splitlines(), "MOTION", f"Frames: {len(values)}"]
    lines.append(f"Frame Time: {period}")
    lines += [" ".join(f"{value:.6f}" for value in row) for row in values]
    return newline.join(lines) + newline
