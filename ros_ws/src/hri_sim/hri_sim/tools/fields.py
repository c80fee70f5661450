"""Message contents as text and as columns."""

from __future__ import annotations

import array
import re
from typing import Any

import numpy as np
import yaml

from hri_prediction.errors import ConfigError

FAR_M = 1e8
"""Distances beyond this stand for that nobody is there: messages say 1e9 [m]."""
_NOTHING = {
    "clearance": ("nobody", lambda value: value > FAR_M),
    "predicted_clearance": ("nobody", lambda value: value > FAR_M),
    "min_separation": ("nobody", lambda value: value > FAR_M),
    "first_contact": ("none", lambda value: value < 0.0),
}
"""Fields that have a number for nothing: what it means, and how it is told."""
_NUMBER = re.compile(r" *(?P<name>\w+): (?P<number>-?[\d.]+(e[+-]?\d+)?)")
_STEP = re.compile(r"\.?(?P<name>[A-Za-z]\w*)|\[(?P<index>-?\d+)\]")


def parse_field(text: str) -> list[str | int]:
    """Steps of a path such as ``position[0]`` or ``header.stamp.sec``.

    Raises:
        ConfigError: when it is no path.
    """
    steps: list[str | int] = []
    at = 0
    while at < len(text):
        match = _STEP.match(text, at)
        if match is None:
            break
        steps.append(match["name"] if match["name"] else int(match["index"]))
        at = match.end()
    if at < len(text) or not steps:
        raise ConfigError(f"field {text!r}", expected="a path such as header.stamp or position[0]")
    return steps


def follow(message: Any, steps: list[str | int]) -> Any:
    """The part of a message that a path names.

    Raises:
        ConfigError: when there is no such field or index; the fields that are there are listed.
    """
    value = message
    done = ""
    for step in steps:
        if isinstance(step, int):
            try:
                value = value[step]
            except (IndexError, TypeError, KeyError) as error:
                size = f"{len(value)} elements" if hasattr(value, "__len__") else "no elements"
                raise ConfigError(f"{done or 'the message'}[{step}]: it has {size}") from error
            done += f"[{step}]"
        else:
            known = _fields(value)
            if step not in known:
                raise ConfigError(
                    f"{done or 'the message'} has no field {step!r}",
                    expected="one of " + ", ".join(known) if known else "no further field",
                )
            value = getattr(value, step)
            done += f".{step}" if done else step
    return value


def _fields(value: Any) -> list[str]:
    getter = getattr(value, "get_fields_and_field_types", None)
    return list(getter()) if getter else []


def plain(value: Any) -> Any:
    """A message as dicts, lists and numbers."""
    names = _fields(value)
    if names:
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (array.array, np.ndarray, list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def nothing(name: str, value: Any) -> str:
    """What a number means that stands for nothing, such as a clearance of 1e9 m; else nothing.

    Args:
        name: The field, or a path to it.
        value: What it holds.
    """
    word, stands = _NOTHING.get(name.rpartition(".")[2], ("", None))
    return word if stands is not None and isinstance(value, float) and stands(value) else ""


def to_text(value: Any, name: str = "") -> str:
    """A message as YAML, arrays on one line; numbers that stand for nothing have a comment.

    Args:
        value: A message or a part of one.
        name: Path to the part.
    """
    node = plain(value)
    if not isinstance(node, dict):
        return nothing(name, node) or str(node)
    text = yaml.dump(node, Dumper=_Dumper, sort_keys=False, width=2**20, allow_unicode=True)
    return "\n".join(_commented(line) for line in text.rstrip().split("\n"))


def _commented(line: str) -> str:
    match = _NUMBER.fullmatch(line)
    word = nothing(match["name"], float(match["number"])) if match else ""
    return f"{line}  # {word}" if word else line


class _Dumper(yaml.SafeDumper):
    pass


def _represent_list(dumper: yaml.SafeDumper, data: list[Any]) -> yaml.Node:
    flat = not any(isinstance(item, (dict, list)) for item in data)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=flat)


_Dumper.add_representer(list, _represent_list)


def columns(value: Any, prefix: str = "") -> dict[str, Any]:
    """A message as one flat row: path to number or text; empty where a number stands for nothing."""
    node = plain(value)
    if isinstance(node, dict):
        items = [(f"{prefix}.{key}" if prefix else key, item) for key, item in node.items()]
    elif isinstance(node, list):
        items = [(f"{prefix}[{index}]", item) for index, item in enumerate(node)]
    else:
        return {prefix: "" if nothing(prefix, node) else node}
    row: dict[str, Any] = {}
    for path, item in items:
        row |= columns(item, path)
    return row
