"""Models on disk: .npz files of plain arrays with a JSON header, never pickles."""

from __future__ import annotations

import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.promp.model import ProMP

FORMAT = "hri-promp-1"

# All that numpy and zipfile raise on files whose bits were changed at random.
_UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    AttributeError,
    TypeError,
    MemoryError,
    OverflowError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


def write_npz(path: str | Path, arrays: dict[str, Any], header: dict[str, Any]) -> None:
    """Write arrays and a JSON header into one compressed .npz, without pickles."""
    np.savez_compressed(path, header=np.array(json.dumps(header)), **arrays)


def read_npz(path: str | Path, expected_format: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read what :func:`write_npz` wrote: (arrays, header).

    Raises:
        DataError: when the file is missing, damaged, or of another format.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        header = json.loads(str(arrays.pop("header")[()]))
    except _UNREADABLE as error:
        text = " ".join(str(error).split())
        raise DataError(
            f"cannot read {path}: {text}", expected=f"a .npz of format {expected_format}"
        ) from error
    found = header.get("format") if isinstance(header, dict) else None
    if found != expected_format:
        raise DataError(f"{path} has format {found!r}", expected=repr(expected_format))
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
    return ProMP.from_arrays(arrays, header)
