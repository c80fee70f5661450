"""QTM: text exports (TSV) of Qualisys Track Manager. Millimetres, z up.

Lines of ``KEY<tab>values``, then the table, either below a line ``Frame  Time  name X  name Y  …`` or
without one: then ``MARKER_NAMES`` names the markers, and Frame and Time may stand before them.
"""

from __future__ import annotations

import numpy as np

from hri_prediction.errors import DataError, cut
from hri_prediction.tracks.importers.markers import MarkerData, unique_labels
from hri_prediction.tracks.importers.text import rows_to_arrays, table_rows
from hri_prediction.tracks.tables import is_number, parse_number


def is_qtm_text(text: str) -> bool:
    """Whether a text is a QTM export: it opens with ``NO_OF_FRAMES`` or has a QTM table header."""
    head = text[:4000].splitlines()[:20]
    return text.startswith("NO_OF_FRAMES\t") or any(line.startswith("Frame\tTime") for line in head)


def read_qtm(text: str, source: str) -> MarkerData:
    """Read the 3D data of a QTM export.

    Raises:
        DataError: when the frequency or the names of the markers are missing, or a row is
            malformed.
    """
    lines = text.splitlines(keepends=True)
    cells = [line.rstrip("\r\n").split("\t") for line in lines[:64]]
    top = next((row for row, line in enumerate(cells) if line[0].strip() == "Frame"), None)
    header = {line[0].strip(): line[1:] for line in cells[:top]}
    kind = (header.get("DATA_INCLUDED") or ["3D"])[0].strip()
    if kind != "3D":
        raise DataError(f"the QTM export holds {cut(kind)} data", expected="an export of 3D data")
    rate = parse_number((header.get("FREQUENCY") or [""])[0], "FREQUENCY")
    if not rate > 0.0:
        raise DataError(f"FREQUENCY = {rate}", expected="a line FREQUENCY with a positive number")
    if top is not None:
        names = [name.strip() for name in "\t".join(cells[top]).rstrip("\t").split("\t")]
        starts = [
            column
            for column, name in enumerate(names)
            if name.endswith(" X")
            and names[column + 1 : column + 3] == [f"{name[:-2]} Y", f"{name[:-2]} Z"]
        ]
        labels = [names[column][:-2] for column in starts]
        lead = 2 if "Time" in names[:2] else 1
        rows = table_rows(lines, top + 2, "\t", len(names))
    else:
        labels, rows, lead = _without_header(header, lines, cells)
        starts = [lead + 3 * index for index in range(len(labels))]
    if not labels:
        raise DataError("the QTM export holds no points", expected="columns such as Elbow X")
    if len(rows) < 2:
        raise DataError(f"the table has {len(rows)} rows", expected="at least two")
    table, positions = rows_to_arrays(rows, starts)
    frames = table[:, 0] if lead else np.arange(1.0, len(table) + 1.0)
    return MarkerData(
        format="QTM TSV",
        labels=unique_labels(labels),
        positions=positions,
        frames=frames,
        rate_hz=rate,
        unit="mm",
        up="+z",
        up_fixed=True,
        clock=table[:, 1] if lead == 2 and np.isfinite(table[:, 1]).all() else None,
        source=source,
    )


def _without_header(
    header: dict[str, list[str]], lines: list[str], cells: list[list[str]]
) -> tuple[list[str], list[list[float]], int]:
    """Names, rows and the number of columns before the first marker, of a table without header."""
    names = [name.strip() for name in header.get("MARKER_NAMES", []) if name.strip()]
    first = next((row for row, line in enumerate(cells) if is_number(line[0])), None)
    if "MARKER_NAMES" not in header or (names and first is None):
        raise DataError(
            "the QTM export has no table header",
            expected="a line that begins with Frame, or a line MARKER_NAMES and rows",
            hint="export with column names and frame numbers",
        )
    if not names or first is None:
        return [], [], 0
    row = cells[first]
    bare = 3 * len(names)
    # QTM may end each line with a tab.
    width = len(row) - (len(row) in (bare + 1, bare + 3) and not row[-1].strip())
    lead = width - bare
    if lead not in (0, 2):
        raise DataError(
            f"line {first + 1} has {width} cells for {len(names)} markers",
            expected=f"{bare}, or {bare + 2} with frame and time",
        )
    return names, table_rows(lines, first + 1, "\t", width), lead
