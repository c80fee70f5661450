"""All numbers that a message holds, of whatever type it is."""

from __future__ import annotations

from typing import Any

import numpy as np


def numbers(value: Any, name: str) -> list[tuple[str, float]]:
    """All floats of a message, with their names; of an array, the first that is not finite.

    Args:
        value: A message, or a field of one.
        name: What it is called in the result.
    """
    if isinstance(value, float):
        return [(name, value)]
    if hasattr(value, "get_fields_and_field_types"):
        return [
            found
            for field in value.get_fields_and_field_types()
            for found in numbers(getattr(value, field), f"{name}.{field}")
        ]
    if isinstance(value, str | bytes | bool | int | np.integer):
        return []
    if hasattr(value, "__iter__"):
        array = np.asarray(value) if not isinstance(value, list) else None
        if array is not None and array.dtype.kind == "f":
            bad = array[~np.isfinite(array)]
            return [(name, float(bad[0]))] if len(bad) else []
        return [found for item in value for found in numbers(item, name)]
    return []
