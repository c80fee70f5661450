"""Models on disk: .npz files of plain arrays with a JSON header, never pickles."""

from __future__ import annotations

import json
import reprlib
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import DataError, HriError
from hri_prediction.files.arrays import read_arrays
from hri_prediction.files.values import parse_json
from hri_prediction.promp.model import ProMP

FORMAT = "hri-promp-1"


def write_npz(path: str | Path, arrays: dict[str, Any], header: dict[str, Any]) -> None:
    """Write arrays and a JSON header into one compressed .npz, without pickles."""
    np.savez_compressed(path, header=np.array(json.dumps(header)), **arrays)


def read_npz(path: str | Path, *formats: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read what :func:`write_npz` wrote: (arrays, header), whose format is one of those given.

    Raises:
        DataError: when the file is missing, damaged, or of another format.
    """
    expected = " or ".join(formats)
    try:
        arrays = read_arrays(path)
        header = parse_json(str(arrays.pop("header")[()]))
    except DataError as error:
        raise DataError(error.problem, expected=f"a .npz of format {expected}") from error
    except (KeyError, ValueError) as error:
        what = "it has no header" if isinstance(error, KeyError) else f"its header is bad: {error}"
        raise DataError(
            f"cannot read {path}: {what}", expected=f"a .npz of format {expected}"
        ) from error
    found = header.get("format") if isinstance(header, dict) else None
    if found not in formats:
        raise DataError(f"{path} has format {reprlib.repr(found)}", expected=expected)
    return arrays, header


def save_promp(path: str | Path, model: ProMP) -> None:
    """Save one model as .npz with a JSON header."""
    arrays, header = model.to_arrays()
    write_npz(path, arrays, {"format": FORMAT, **header})


def load_promp(path: str | Path) -> ProMP:
    """Load one model.

    Raises:
        DataError: on damaged or foreign files.
    """
    arrays, header = read_npz(path, FORMAT)
    try:
        return ProMP.from_arrays(arrays, header)
    except HriError as error:
        raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
