"""What the readers of text formats share: decoding, and tables of three columns a marker."""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Sequence

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError
from hri_prediction.tracks.tables import parse_number

_MOST_LACKING = 50
"""Cells that rows lack at their ends for each that is there: markers that are nearly never seen."""


def decode(content: bytes) -> str:
    """Text of a file: UTF-8 (with or without its mark), UTF-16 with its mark, else Windows' 1252.

    Raises:
        DataError: when the file is not text.
    """
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        encodings = ["utf-16"]
    elif b"\x00" in content[:4096]:
        encodings = []
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise DataError(
        "the file is not text",
        expected="C3D, or text in UTF-8, UTF-16 with its mark or Windows-1252",
    )


def table_rows(
    lines: Sequence[str], first: int, separator: str, width: int, *, padded: bool = False
) -> list[list[float]]:
    """Numbers of the lines from number ``first`` (from 1) on; NaN where a cell says missing.

    Lines without any content are passed over. Empty cells beyond the width (a separator at the end
    of the line) are dropped.

    Args:
        lines: All lines of the file, with their ends.
        first: Number of the first line of the table.
        separator: Between cells.
        width: Cells of a row.
        padded: Cells that lack at the end are missing markers: some programs cut off what is empty
            there. They must be whole markers, and the line must have an end.

    Raises:
        DataError: naming the line when a row has another number of cells, or one is no number.
    """
    rows: list[list[float]] = []
    there, lacking = 0, 0
    for number, line in enumerate(lines[first - 1 :], start=first):
        cells = line.rstrip("\r\n").split(separator)
        if not any(cell.strip() for cell in cells):
            continue
        while len(cells) > width and not cells[-1].strip():
            cells.pop()
        lack = width - len(cells)
        if padded and lack > 0 and lack % 3 == 0 and line.endswith(("\n", "\r")):
            there, lacking = there + len(cells), lacking + lack
            if lacking > _MOST_LACKING * (there + width):
                raise DataError(
                    f"up to line {number} the rows lack {lacking} of their cells",
                    expected=f"{width} in each, as in the header",
                )
            cells += [""] * lack
        if len(cells) != width:
            raise DataError(
                f"line {number} has {len(cells)} cells", expected=f"{width}, as in the header"
            )
        rows.append([parse_number(cell, f"line {number}") for cell in cells])
    return rows


def rows_to_arrays(
    rows: Sequence[Sequence[float]], columns: Iterable[int]
) -> tuple[FloatArray, FloatArray]:
    """The table, and the positions (N, M, 3) of markers whose x stands in the given columns."""
    if not rows:
        raise DataError("the table has no rows", expected="at least two")
    table = np.array(rows, dtype=np.float64)
    starts = np.fromiter(columns, dtype=int)
    positions = table[:, starts[:, None] + np.arange(3)] if len(starts) else np.empty((0, 0, 3))
    return table, positions
