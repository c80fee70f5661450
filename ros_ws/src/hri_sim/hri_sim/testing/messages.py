"""All numbers that a message holds, of whatever type it is."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np

WITHOUT_FLOATS = ("std_msgs/Header", "builtin_interfaces/Time", "builtin_interfaces/Duration")
"""Messages in messages that are there often."""


def numbers(value: Any, name: str) -> list[tuple[str, float]]:
    """All floats of a message, with their names; of an array, the first that is not finite.

    Args:
        value: A message, or a field of one.
        name: What it is called in the result.
    """
    if isinstance(value, float):
        return [(name, value)]
    if hasattr(value, "get_fields_and_field_types"):
        message_type: Any = type(value)
        return [
            found
            for field in _fields_of_floats(message_type)
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


@cache
def _fields_of_floats(message_type: Any) -> tuple[str, ...]:
    """Fields of a message type in which there may be floats: strings, whole numbers, stamps are passed."""
    fields: dict[str, str] = message_type.get_fields_and_field_types()
    return tuple(name for name, kind in fields.items() if _may_hold_floats(kind))


def _may_hold_floats(kind: str) -> bool:
    """Whether there may be floats in a type, as ROS writes it, such as ``sequence<double>``."""
    kind = re.sub(r"^sequence<([^,>]*).*$|\[.*\]$", r"\1", kind)
    return kind in ("double", "float") or ("/" in kind and kind not in WITHOUT_FLOATS)
