"""Parts of long work on the disk: what was done before by the same code is not done again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hri_prediction.compiled import processor
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.workers import versions


def kept(
    folder: Path, work: str, packages: Sequence[str], key: str, make: Callable[[], dict[str, Any]]
) -> dict[str, Any]:
    """What a part of long work came to: from a file, if it was done before.

    Args:
        folder: Where files are kept; it is there.
        work: Module that the part is done in: sources that it depends on decide about the result.
        packages: Others whose versions do.
        key: Stands for all else that does: settings, seeds, data.
        make: Does it; what comes of it is plain values, all numbers finite.
    """
    file = kept_file(folder, work, packages, key)
    content = read_kept(file)
    if content is None:
        content = make()
        keep(file, content)
    return content


def kept_file(folder: Path, work: str, packages: Sequence[str], key: str) -> Path:
    """Where a part is kept; arguments as of :func:`kept`."""
    parts = repr((dependency_hash(work), processor(), sorted(versions(packages).items()), key))
    return folder / f"{hashlib.sha256(parts.encode()).hexdigest()[:20]}.json"


def read_kept(file: Path) -> dict[str, Any] | None:
    """What is kept there; none: it was not done yet, or broken off."""
    try:
        content = json.loads(file.read_text())
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None


def keep(file: Path, content: dict[str, Any]) -> None:
    """Keep what a part came to, whole or not at all."""
    new = file.with_suffix(".new")
    new.write_text(json.dumps(content, allow_nan=False) + "\n")
    new.replace(file)
