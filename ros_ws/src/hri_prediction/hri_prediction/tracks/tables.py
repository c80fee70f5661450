"""What the readers of track files have in common: cells of tables and spans of rows."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hri_prediction.errors import DataError, shown

_MISSING = {"", "nan", "null", "none", "n/a", "na", "#n/a", "-", "--"}
_NO_NUMBER = re.compile(r"[+-]?(1\.#(qnan|snan|ind|nan)0*|nan\((ind|snan)\)|nan)")
"""How C runtimes, Windows' before all, write what is not a number."""
_NUMBER = re.compile(
    r"[+-]?(([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?|inf(inity)?)", re.IGNORECASE
)
"""Digits are matched in one way only: with several, a long cell that is no number takes hours."""

_MOST_SHARED = 10
"""How many trials may have the same row, on average; each has a copy of it."""


def is_number(text: str) -> bool:
    """Whether a text is a number as programs write them, an infinite one included.

    Python's own ``float`` takes ``1_0`` for 10, and the digits of every script.
    """
    return _NUMBER.fullmatch(text.strip()) is not None


def parse_number(cell: str, where: str) -> float:
    """A cell of a table as a float; NaN where it says that nothing was measured.

    Such are empty cells, ``nan``, ``null``, ``N/A``, ``1.#QNAN``, ``-nan(ind)`` and the like.

    Raises:
        DataError: naming ``where`` and the cell when it is no finite number.
    """
    text = cell.strip()
    if text.lower() in _MISSING or _NO_NUMBER.fullmatch(text.lower()):
        return math.nan
    if not is_number(text):
        raise DataError(f"{where} holds {text[:40]!r}", expected="a number")
    value = float(text)
    if math.isinf(value):
        raise DataError(f"{where} holds {text!r}", expected="a finite number")
    return value


def csv_rows(lines: Sequence[str], first: int = 1) -> Iterator[list[str]]:
    """The cells of lines of a CSV file.

    Args:
        lines: The lines.
        first: Number of the first of them in the file.

    Raises:
        DataError: naming the line, when a cell is longer than any that is meant, as with quotes that no
            other closes.
    """
    reader = csv.reader(lines)
    try:
        yield from reader
    except csv.Error as error:
        raise DataError(
            f"line {first + reader.line_num - 1} is no CSV: {error}", expected="cells and commas"
        ) from error


def one_number(arrays: Mapping[str, np.ndarray], name: str) -> float:
    """The number that an array without dimensions holds.

    Raises:
        DataError: when there is none of that name, or it is another array.
    """
    array = arrays.get(name)
    if array is None or array.ndim or array.dtype.kind not in "fiu":
        raise DataError(f"{name} is {shown(array)}", expected="one number")
    return float(array)


def row_spans(arrays: Mapping[str, np.ndarray], rows: int) -> list[tuple[int, int]]:
    """First and past-the-last row of each trial, from the arrays ``start`` and ``length``.

    Raises:
        DataError: when these are not two equally long lists of whole numbers, there is no trial,
            a trial reaches beyond the ``rows`` rows or has fewer than two, or all together have so many
            that they must be the same ones again and again.
    """
    start, length = arrays["start"], arrays["length"]
    for name, array in (("start", start), ("length", length)):
        if array.ndim != 1 or array.dtype.kind not in "iu" or array.shape != start.shape:
            raise DataError(f"{name} is {array.dtype} {array.shape}", expected="integers (trials,)")
    if not len(start):
        raise DataError("the file holds no trial", expected="at least one")
    spans = []
    for index, (first, count) in enumerate(zip(start.tolist(), length.tolist(), strict=True)):
        if first < 0 or count < 2 or first + count > rows:
            raise DataError(
                f"trial {index} has rows {first} to {first + count} of {rows}",
                expected="at least two rows that exist",
            )
        spans.append((first, first + count))
    total = sum(last - first for first, last in spans)
    if total > _MOST_SHARED * rows:
        raise DataError(
            f"{len(spans)} trials have {total} rows together", expected=f"those of {rows} rows"
        )
    return spans
