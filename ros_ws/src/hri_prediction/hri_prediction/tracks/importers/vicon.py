"""Vicon Nexus: ASCII exports (CSV). Only the part ``Trajectories`` is read.

The part begins with its name, then the rate, the markers (``Subject:Name`` above the first of its
columns), Frame and Sub Frame with the axes, and the units. It ends at an empty line. Nexus has z up.
"""

from __future__ import annotations

import numpy as np

from hri_prediction.errors import DataError, cut, shown
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.importers.text import rows_to_arrays, table_rows
from hri_prediction.tracks.tables import csv_rows, parse_number

_PARTS = ("trajectories", "devices", "joints", "model outputs", "segments", "events")


def _cells(line: str, number: int) -> list[str]:
    return [cell.strip() for cell in next(csv_rows([line.rstrip("\r\n")], number), [])]


def is_vicon(text: str) -> bool:
    """Whether a text begins with the name of a part of a Nexus export."""
    head = text.lstrip().partition("\n")[0]
    return head.split(",")[0].strip().strip('"').lower() in _PARTS


def read_vicon(text: str, source: str) -> MarkerData:
    """Read the trajectories of a Nexus export.

    Raises:
        DataError: when it holds none, or their header or a row is malformed.
    """
    lines = text.splitlines(keepends=True)
    heads = [line.split(",")[0].strip().strip('"').lower() for line in lines]
    if "trajectories" not in heads:
        raise DataError(
            "the Nexus export holds no points: it has no part Trajectories",
            hint="export trajectories too",
        )
    top = heads.index("trajectories")
    if len(lines) < top + 6:
        raise DataError(
            "the Nexus header is bad: the file ends in it",
            expected="rate, markers, axes, units and rows below Trajectories",
        )
    rate = parse_number(heads[top + 1], f"line {top + 2}")
    names, axes, units = (_cells(lines[top + k], top + k + 1) for k in (2, 3, 4))
    if not axes or axes[0].lower() != "frame":
        raise DataError(
            f"the Nexus header is bad: line {top + 4} begins with {shown(axes[0] if axes else '')}",
            expected="Frame, Sub Frame, X, Y, Z, …",
        )
    named = [
        column
        for column, name in enumerate(names)
        if name and [axis.lower() for axis in axes[column : column + 3]] == ["x", "y", "z"]
    ]
    if not named:
        raise DataError("the Nexus export holds no points", expected="markers above X, Y, Z")
    said = {cell for column in named for cell in units[column : column + 3]}
    if len(said) != 1:
        raise DataError(
            f"the Nexus header is bad: line {top + 5} has the units {cut(', '.join(sorted(said)))}",
            expected="one unit of all markers",
        )
    end = next(
        (n for n in range(top + 5, len(lines)) if not lines[n].strip(", \t\r\n")), len(lines)
    )
    while axes and not axes[-1]:
        axes.pop()
    rows = table_rows(lines[:end], top + 6, ",", len(axes))
    table, positions = rows_to_arrays(rows, named)
    return MarkerData(
        format="Vicon CSV",
        labels=unique_labels([names[column] for column in named]),
        positions=positions,
        frames=table[:, 0],
        rate_hz=0.0 if np.isnan(rate) else rate,
        unit=said.pop(),
        up="+z",
        up_fixed=True,
        source=source,
    )
