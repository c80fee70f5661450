"""Models on disk: .npz files of plain arrays with a JSON header, never pickles."""

from __future__ import annotations

import json
import tokenize
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
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


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
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        header = json.loads(str(arrays.pop("header")[()]))
    except _UNREADABLE as error:
        # Not what numpy says of pickles: to load one "unsafely" is no way out.
        text = " ".join(str(error).split()).partition(" If you trust")[0]
        raise DataError(
            f"cannot read {path}: {text}", expected=f"a .npz of format {expected}"
        ) from error
    found = header.get("format") if isinstance(header, dict) else None
    if found not in formats:
        raise DataError(f"{path} has format {found!r}", expected=expected)
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
