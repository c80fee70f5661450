"""Checksums of JSON files: a digit that is wrong makes another number, which nothing else would tell.

What is hashed is not the text but its values, as :func:`json.dumps` writes them with sorted keys and no
spaces: a file may be laid out anew. Archives of arrays need none: zip has checksums.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hri_prediction.errors import DataError

KEY = "sha256"
"""Of the checksum in a file."""


def checksum(content: Mapping[str, Any]) -> str:
    """Of all values of a file but the checksum itself (64 hex digits)."""
    rest = {name: value for name, value in content.items() if name != KEY}
    # As they are read again: keys are texts then, and tuples lists.
    plain = json.loads(json.dumps(rest))
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """The content of a file with its checksum at the end."""
    rest = {name: value for name, value in content.items() if name != KEY}
    return {**rest, KEY: checksum(rest)}


def check_seal(content: Mapping[str, Any], path: str | Path) -> None:
    """Compare a file's values with its checksum; one without any, as of earlier versions, passes.

    Args:
        content: What was read.
        path: The file, for the error.

    Raises:
        DataError: they differ.
    """
    if KEY not in content:
        return
    try:
        fits = content[KEY] == checksum(content)
    except RecursionError:  # nested just not too deeply to be read
        fits = False
    if not fits:
        raise DataError(
            f"{path}: its values are not those that its {KEY} was made of",
            expected="a file as it was written",
            hint=f"copy or make it anew; if it was changed on purpose, remove {KEY} from it",
        )
