"""Archives of arrays as ``numpy.savez`` writes them, without pickles and without trust.

An archive of a few kilobytes can unpack to gigabytes, and the header of an array can claim terabytes that
are not there. So what each file says of itself is compared with what there is before anything is allocated.
"""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.files.content import read_content

Arrays = dict[str, NDArray[Any]]

_ALWAYS = 1 << 28
"""What an archive may unpack to in any case [bytes]."""
_SPREAD = 50
"""And so many times its own size."""
_MOST_FILES = 100_000
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Of compression, of all that zip knows: those that numpy writes, and that unpack in small steps."""
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
_LAST_CHARACTER, _SURROGATES = 0x10FFFF, (0xD800, 0xDFFF)


def read_arrays(path: str | Path) -> Arrays:
    """All arrays of an archive, by name.

    Raises:
        DataError: naming the file, when it is missing, or as :func:`parse_arrays`.
    """
    content = read_content(path)
    try:
        return parse_arrays(content)
    except DataError as error:
        raise DataError(f"cannot read {path}: {error.problem}", expected=error.expected) from error


def parse_arrays(content: bytes) -> Arrays:
    """All arrays of an archive, by name.

    Args:
        content: The archive.

    Returns:
        Numbers of any kind, and texts that are Unicode; no objects.

    Raises:
        DataError: when it is damaged, unpacks to far more than its size, or holds anything but arrays.
    """
    expected = "a whole .npz file of plain arrays (no objects)"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return _all_of(archive, max(_ALWAYS, _SPREAD * len(content)))
    except DataError as error:
        raise DataError(error.problem, expected=expected) from error
    except Exception as error:  # zipfile, zlib and numpy raise errors of a dozen kinds
        # Not what numpy says of pickles: to load one "unsafely" is no way out.
        text = " ".join(str(error).split()).partition(" If you trust")[0]
        raise DataError(f"{text or type(error).__name__:.300}", expected=expected) from error


def _all_of(archive: zipfile.ZipFile, most: int) -> Arrays:
    files = archive.infolist()
    total = sum(file.file_size for file in files)
    if total > most or len(files) > _MOST_FILES:
        raise DataError(f"an archive that unpacks to {len(files)} files of {total} bytes")
    names = [file.filename.removesuffix(".npy") for file in files]
    if len(set(names)) < len(names):
        raise DataError("an archive that holds an array twice")
    return {name: _array(archive, file) for name, file in zip(names, files, strict=True)}


def _array(archive: zipfile.ZipFile, file: zipfile.ZipInfo) -> NDArray[Any]:
    if file.compress_type not in _METHODS:
        raise DataError(f"{file.filename!r:.100} has a compression that numpy does not write")
    with archive.open(file) as stream:
        _check_header(stream, file)
    with archive.open(file) as stream:
        array: NDArray[Any] = npy.read_array(stream, allow_pickle=False)
    if array.dtype.kind == "U":
        _check_characters(array, file)
    return array


def _check_header(stream: IO[bytes], file: zipfile.ZipInfo) -> None:
    """Compare the shape that a file claims with its size."""
    version = npy.read_magic(stream)
    if version not in _HEADERS:
        raise DataError(f"{file.filename!r:.100} has version {version} of numpy's format")
    shape, _, kind = _HEADERS[version](stream)
    there = file.file_size - stream.tell()
    # A shape with a zero in it needs no bytes, whatever else it claims.
    largest = math.prod(max(size, 1) for size in shape) * kind.itemsize
    needed = math.prod(shape) * kind.itemsize
    if kind.hasobject:
        raise DataError(f"{file.filename!r:.100} holds Python objects")
    if (
        min(shape, default=0) < 0
        or not kind.itemsize
        or needed != there
        or largest > _ALWAYS + there
    ):
        raise DataError(
            f"{file.filename!r:.100} claims the shape {shape!s:.100} of {kind!s:.100} in {there} bytes"
        )


def _check_characters(array: NDArray[Any], file: zipfile.ZipInfo) -> None:
    """Refuse what is no Unicode, of which numpy would make texts that break whatever looks at them."""
    plain = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("="), copy=False)
    points = np.frombuffer(plain.tobytes(), np.uint32)
    low, high = _SURROGATES
    if ((points > _LAST_CHARACTER) | ((points >= low) & (points <= high))).any():
        raise DataError(f"{file.filename!r:.100} holds texts that are no Unicode")
