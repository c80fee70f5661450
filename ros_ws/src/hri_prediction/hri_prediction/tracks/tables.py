"""What the readers of track files have in common: cells of tables and spans of rows."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from hri_prediction.errors import DataError

_MISSING = {"", "nan", "null", "none", "n/a", "na", "#n/a", "-", "--"}
_NO_NUMBER = re.compile(r"[+-]?(1\.#(qnan|snan|ind|nan)0*|nan\((ind|snan)\)|nan)")
"""How C runtimes, Windows' before all, write what is not a number."""
_NUMBER = re.compile(r"[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?|inf(inity)?)", re.IGNORECASE)


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


def row_spans(arrays: Mapping[str, np.ndarray], rows: int) -> list[tuple[int, int]]:
    """First and past-the-last row of each trial, from the arrays ``start`` and ``length``.

    Raises:
        DataError: when these are not two equally long lists of whole numbers, there is no trial,
            or a trial reaches beyond the ``rows`` rows or has fewer than two.
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
    return spans
