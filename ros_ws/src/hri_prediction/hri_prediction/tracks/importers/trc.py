"""TRC: text tables of Motion Analysis, used by OpenSim. Separated by tabs, or by commas.

Line 1 names the file, lines 2 and 3 hold rates, counts and the unit, line 4 the markers (one name
above three columns), line 5 X1, Y1, Z1 and so on. The counts are often wrong: the table counts.
"""

from __future__ import annotations

import itertools

import numpy as np

from hri_prediction.errors import DataError, cut, shown
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.importers.text import rows_to_arrays, table_rows
from hri_prediction.tracks.tables import parse_number


def is_trc(text: str) -> bool:
    """Whether a text begins as TRC files do."""
    return text.lstrip().lower().startswith("pathfiletype")


def read_trc(text: str, source: str) -> MarkerData:
    """Read the content of a TRC file.

    Raises:
        DataError: when its header is not that of a TRC file, or a row of its table is malformed.
    """
    lines = text.splitlines(keepends=True)
    top = next(
        (n for n, line in enumerate(lines) if line.strip().lower().startswith("frame#")), None
    )
    if top is None:
        raise DataError("the TRC header is bad", expected="a line that begins with Frame#")
    separator = "\t" if "\t" in lines[top] else ","
    header = _header(lines[:top], separator)
    names = [cell.strip() for cell in lines[top].rstrip("\r\n").split(separator)]
    if len(names) < 2 or names[1].lower() != "time":
        raise DataError(
            f"the TRC header is bad: line {top + 1} is {lines[top][:40].strip()!r}",
            expected="Frame#, Time and the names of the markers, separated by tabs or commas",
        )
    named = [column for column, name in enumerate(names) if name and column >= 2]
    if not named:
        raise DataError("the TRC file holds no points", expected="markers in its header")
    odd = [names[column] for column in named if (column - 2) % 3]
    if odd:
        raise DataError(
            f"the TRC header is bad: marker {shown(odd[0])} does not stand above an x",
            expected="one name above three columns",
        )
    # Line 5 numbers the coordinates: it must exist, and name as many columns as there are.
    axes = lines[top + 1].strip(" \r\n").lower() if top + 1 < len(lines) else ""
    if not axes.lstrip(separator + " ").startswith("x"):
        raise DataError(
            f"the TRC header is bad: line {top + 2} is {axes[:40]!r}", expected="X1, Y1, Z1, …"
        )
    width = max(named) + 3
    rows = table_rows(lines, top + 3, separator, width, padded=True)
    table, positions = rows_to_arrays(rows, named)
    clock = table[:, 1]
    return MarkerData(
        format="TRC",
        labels=unique_labels([names[column] for column in named]),
        positions=positions,
        frames=table[:, 0],
        rate_hz=_rate(header),
        unit=header.get("units", ""),
        clock=clock if np.isfinite(clock).all() else None,
        source=source,
        notes=_notes(header, len(rows), len(named)),
    )


def _header(lines: list[str], separator: str) -> dict[str, str]:
    for names, values in itertools.pairwise(lines):
        keys = [cell.strip().lower() for cell in names.split(separator)]
        if "datarate" in keys:
            cells = [cell.strip() for cell in values.split(separator)]
            return {key: cell for key, cell in zip(keys, cells, strict=False) if key}
    raise DataError("the TRC header is bad", expected="a line with DataRate, and its values below")


def _rate(header: dict[str, str]) -> float:
    rate = parse_number(header.get("datarate", ""), "DataRate")
    return 0.0 if np.isnan(rate) else rate


def _notes(header: dict[str, str], frames: int, markers: int) -> tuple[str, ...]:
    """Where the header counts otherwise than the table."""
    notes = []
    for key, found, what in (("numframes", frames, "frames"), ("nummarkers", markers, "markers")):
        said = header.get(key, "")
        if said and said != str(found):
            notes.append(f"the header says {cut(said)} {what}, the table has {found}")
    return tuple(notes)
