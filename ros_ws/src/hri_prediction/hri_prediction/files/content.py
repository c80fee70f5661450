"""Regular files: what is no file is not waited for, and what is too large is not begun."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from hri_prediction.errors import DataError

MOST_BYTES = 1 << 31
"""Largest file that is read whole: a recording of hours, with all its analogue channels."""
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def open_file(path: str | Path) -> BinaryIO:
    """Open a regular file for reading.

    A pipe without a writer would be waited for, and a device may never end.

    Raises:
        DataError: when there is no file, or none that can be read.
    """
    try:
        opened = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        kind = stat.S_IFMT(os.fstat(opened).st_mode)
    except (OSError, ValueError) as error:  # ValueError: no name of a file has a NUL in it
        raise DataError(f"cannot read {path}: {_reason(error)}") from error
    if kind != stat.S_IFREG:
        os.close(opened)
        raise DataError(
            f"cannot read {path}: it is {_KINDS.get(kind, 'no file')}", expected="a regular file"
        )
    return os.fdopen(opened, "rb")


def read_content(path: str | Path, most: int = MOST_BYTES) -> bytes:
    """All of a regular file.

    Args:
        path: The file.
        most: Size beyond which it is refused [bytes].

    Raises:
        DataError: when there is no file, none that can be read, or one that is larger.
    """
    with open_file(path) as stream:
        try:
            size = os.fstat(stream.fileno()).st_size
            content = stream.read() if size <= most else b""
        except OSError as error:
            raise DataError(f"cannot read {path}: {_reason(error)}") from error
    size = max(size, len(content))
    if size > most:
        raise DataError(f"{path} has {size} bytes", expected=f"a file of {most} bytes at most")
    return content


def read_text(path: str | Path, most: int = MOST_BYTES) -> str:
    """All of a text file in UTF-8; errors as :func:`read_content`, also when it is no such text."""
    try:
        return read_content(path, most).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(f"cannot read {path}: {error}", expected="text in UTF-8") from error


def _reason(error: OSError | ValueError) -> str:
    return str(getattr(error, "strerror", None) or error)
