"""Files that are written as a whole: whoever reads one finds all of the old or all of the new."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from hri_prediction.errors import HriError


def write_whole(files: Mapping[Path, Callable[[Path], object]]) -> None:
    """Write files so that each is there as it was before or as it is after, and never half.

    All are on the disk before the first takes its place; they do so in their order.

    Args:
        files: What writes each, given where to write instead: a name of the same kind in the same folder.

    Raises:
        HriError: when the disk is full or a folder cannot be written to; what was there is as it was.
    """
    parts = {path: path.with_name(f".{path.stem}.part{path.suffix}") for path in files}
    at = Path()
    try:
        for path, write in files.items():
            at = path
            path.parent.mkdir(parents=True, exist_ok=True)
            write(parts[path])
            _sync(parts[path])
        for at, part in parts.items():
            os.replace(part, at)
        for folder in {path.parent for path in files}:
            _sync(folder)
    except OSError as error:
        raise HriError(
            f"cannot write {at}: {error.strerror or error}",
            hint="make room on the disk or choose a folder that can be written to; what was saved "
            "before is still there",
        ) from error
    finally:
        for part in parts.values():
            with contextlib.suppress(OSError):
                part.unlink()


def _sync(path: Path) -> None:
    """Have a file or a folder on the disk, not only on its way there."""
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
