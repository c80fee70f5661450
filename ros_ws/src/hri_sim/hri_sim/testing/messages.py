"""All numbers that a message holds, of whatever type it is."""

from __future__ import annotations

import re
from functools import lru_cache
from importlib import import_module
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
            for field in _fields_of_floats(type(value))
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


@lru_cache(maxsize=None)
def _fields_of_floats(message_type: Any) -> tuple[str, ...]:
    """Fields of a message in which there may be floats: strings, whole numbers and stamps are passed."""
    fields: dict[str, str] = message_type.get_fields_and_field_types()
    return tuple(name for name, kind in fields.items() if _holds_floats(kind))


def _holds_floats(kind: str) -> bool:
    """Whether a type, as ROS writes it, is or holds floats: ``sequence<double>``, ``std_msgs/Header``."""
    kind = re.sub(r"^sequence<([^,>]*).*$|\[.*\]$", r"\1", kind)
    if "/" not in kind:
        return kind in ("double", "float")
    package, _, name = kind.partition("/")
    return bool(_fields_of_floats(getattr(import_module(f"{package}.msg"), name)))
