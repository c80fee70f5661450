"""C3D: binary files of points and analogue channels (c3d.org), through ezc3d.

Intel, DEC and MIPS byte order, whole and floating point numbers. A point with a negative residual
was not seen. ``POINT:Y_SCREEN`` names the axis that a viewer draws upwards.
"""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from hri_prediction.errors import DataError, cut
from hri_prediction.tracks.importers.c3d_check import MOST_FRAMES, check_counts
from hri_prediction.tracks.importers.c3d_order import BLOCK, intel_of_mips
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels

_KEY = 0x50
_PROCESSORS = {84: "Intel", 85: "DEC", 86: "MIPS"}


def is_c3d(content: bytes) -> bool:
    """Whether a file is marked as C3D: its second byte, and that of its parameter section."""
    if len(content) < BLOCK or content[1] != _KEY:
        return False
    start = (content[0] - 1) * BLOCK
    return 0 < start < len(content) - 4 and content[start + 3] in _PROCESSORS


def read_c3d(path: Path, content: bytes) -> MarkerData:
    """Read the points of a C3D file.

    Args:
        path: The file, which ezc3d opens itself.
        content: What is in it.

    Raises:
        DataError: when it is damaged or cut off, or holds no points.
    """
    if not is_c3d(content):
        raise DataError(
            "the C3D header is bad: it does not point to a parameter section",
            expected=f"byte {_KEY:#x} in second place and a processor type of 84 to 86",
        )
    order = _PROCESSORS[content[(content[0] - 1) * BLOCK + 3]]
    check_counts(content, order)
    try:
        file = _load(path, content, order)
        group = file["parameters"]["POINT"]
        points = np.asarray(file["data"]["points"], dtype=np.float64)
        residuals = np.asarray(file["data"]["meta_points"]["residuals"][0])
        header = file["header"]["points"]
        rate = float(_first(group, "RATE", 0.0)) or float(header["frame_rate"])
        first = int(header["first_frame"]) + 1
    except DataError:
        raise
    except Exception as error:  # ezc3d raises plain RuntimeError, OSError, ValueError, KeyError
        raise DataError(
            f"the C3D file ({order}) cannot be read: {cut(' '.join(str(error).split()))}",
            expected="a whole C3D file",
        ) from error
    count = points.shape[1]
    if not count or not points.shape[2]:
        raise DataError(
            f"the C3D file holds {count} points in {points.shape[2]} frames", expected="points"
        )
    _check_length(content, order, points.shape[2])
    labels = _labels(group, count)
    positions = np.moveaxis(points[:3], 0, -1).swapaxes(0, 1)
    positions[(residuals < 0.0).T] = np.nan
    positions[~np.isfinite(positions).all(axis=-1)] = np.nan
    screen = str(_first(group, "Y_SCREEN", "")).strip().lower()
    return MarkerData(
        format="C3D",
        labels=labels,
        positions=np.ascontiguousarray(positions),
        frames=first + np.arange(len(positions), dtype=np.float64),
        rate_hz=rate,
        unit=str(_first(group, "UNITS", "")).strip(),
        up=screen if screen in ("+x", "-x", "+y", "-y", "+z", "-z") else "",
        source=path.name,
        notes=(f"{order} byte order",),
    )


def _load(path: Path, content: bytes, order: str) -> Any:
    if order != "MIPS":
        return ezc3d.c3d(str(path))
    with tempfile.TemporaryDirectory() as folder:
        turned = Path(folder) / "turned.c3d"
        turned.write_bytes(intel_of_mips(content))
        return ezc3d.c3d(str(turned))


def _check_length(content: bytes, order: str, frames: int) -> None:
    """Compare with the header: where a file was cut off, ezc3d returns what is left."""
    first, last = struct.unpack_from(">2H" if order == "MIPS" else "<2H", content, 6)
    if last != MOST_FRAMES and frames < last - first + 1:
        raise DataError(
            f"the C3D file is cut off: it holds {frames} frames",
            expected=f"{last - first + 1}, as in its header",
        )


def _labels(group: Any, count: int) -> tuple[str, ...]:
    names: list[str] = []
    for key in ("LABELS", *(f"LABELS{number}" for number in range(2, 10))):
        if key in group:
            names += [str(name) for name in group[key]["value"]]
    names = names[:count]
    names += [""] * (count - len(names))
    return unique_labels([name.strip() or f"point {i + 1}" for i, name in enumerate(names)])


def _first(group: Any, key: str, default: Any) -> Any:
    values = group[key]["value"] if key in group else []
    return values[0] if len(values) else default
