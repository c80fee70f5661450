"""Message definitions for bags: the ``ros2msg`` text of a type with everything that it contains.

The texts come from the ``share`` folders of the ament prefixes, where every interface package
installs its .msg, .srv and .action files. The messages behind actions and service events have no
file of their own; their definitions follow from the .action and .srv files by fixed rules
(https://design.ros2.org/articles/actions.html).
"""

from __future__ import annotations

import functools
import importlib
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hri_prediction.errors import DataError, cut

ROS2MSG = "ros2msg"
"""Encoding of definitions that are ROS's own text."""
_SEPARATOR = "=" * 80
_FIELD = re.compile(r"^(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*")
_PRIMITIVE = re.compile(r"^(bool|byte|char|w?string|float(32|64)|u?int(8|16|32|64))$")
_TYPE = re.compile(r"[a-z][a-z0-9_]{0,80}/(msg|srv|action)/[A-Z][A-Za-z0-9_]{0,120}")
_UUID = "unique_identifier_msgs/UUID goal_id\n"


@dataclass(frozen=True)
class MessageDefinition:
    """Definition of one message type as it stands in a bag.

    Attributes:
        name: Type, such as ``std_msgs/msg/String``.
        encoding: ``ros2msg``, or empty when no definition was found.
        text: The definition and all its dependencies; empty when none was found.
    """

    name: str
    encoding: str
    text: str


def share_folders() -> list[Path]:
    """``share`` of every ament prefix: those of AMENT_PREFIX_PATH, then of this environment."""
    prefixes = [item for item in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if item]
    return [Path(prefix) / "share" for prefix in dict.fromkeys([*prefixes, sys.prefix])]


@functools.cache
def message_definition(type_name: str) -> MessageDefinition:
    """Definition of a type with its dependencies, empty when a part of it cannot be found."""
    try:
        package, kind, name = type_name.split("/")
    except ValueError:
        return MessageDefinition(type_name, "", "")
    main = _own_text(package, kind, name)
    if main is None:
        return MessageDefinition(type_name, "", "")
    parts = [main]
    seen = {(package, name)}
    queue = _references(package, main)
    while queue:
        key = queue.pop(0)
        if key in seen:
            continue
        seen.add(key)
        found = _referenced_text(*key)
        if found is None:
            return MessageDefinition(type_name, "", "")
        label, text = found
        parts.append(f"{_SEPARATOR}\nMSG: {label}\n{text}")
        queue += _references(key[0], text)
    joined = "\n".join(part.rstrip("\n") for part in parts) + "\n"
    return MessageDefinition(type_name, ROS2MSG, joined)


@functools.cache
def as_installed(type_name: str, text: str) -> bool:
    """Whether a definition in a bag has the fields of the installed one, and its messages so their bytes.

    Comments and constants do not matter, nor in which order dependencies stand. Where one of both is not
    known, or a dependency is not in both, nothing speaks against it.

    Args:
        type_name: Of the message.
        text: The bag's definition with its dependencies.
    """
    ours, theirs = _fields_of(message_definition(type_name).text), _fields_of(text)
    return all(ours[name] == theirs[name] for name in ours.keys() & theirs.keys())


def _fields_of(text: str) -> dict[str, list[list[str]]]:
    """Words of the fields of each part of a definition, by its label; of the message itself, empty."""
    found: dict[str, list[list[str]]] = {}
    for part in re.split(r"(?m)^=+[ \t]*$", text):
        lines = [line.split("#", 1)[0].split() for line in part.splitlines()]
        lines = [line for line in lines if line]
        label = ""
        if lines and lines[0][0] == "MSG:":
            label = lines.pop(0)[1].replace("/msg/", "/")
        # A type of the same package may be named with it or without.
        found[label] = [
            [line[0].rpartition("/")[2], line[1]]
            for line in lines
            if len(line) > 1 and "=" not in "".join(line[1:3])
        ]
    return found if text else {}


def _references(package: str, text: str) -> list[tuple[str, str]]:
    """Types (package, name) of the fields of a definition that are messages themselves."""
    found: list[tuple[str, str]] = []
    for line in text.splitlines():
        match = _FIELD.match(line.split("#", 1)[0].strip())
        if match is None or _PRIMITIVE.match(match["type"]):
            continue
        first, *rest = match["type"].split("/")
        found.append((first, rest[-1]) if rest else (package, first))
    return found


def _referenced_text(package: str, name: str) -> tuple[str, str] | None:
    """Label and text of a type that a field names; fields do not say of which kind it is."""
    for kind in ("msg", "action", "srv"):
        text = _own_text(package, kind, name)
        if text is not None:
            label = f"{package}/{name}" if kind == "msg" else f"{package}/{kind}/{name}"
            return label, text
    return None


def _own_text(package: str, kind: str, name: str) -> str | None:
    """Text of one type without its dependencies."""
    if kind == "msg":
        return _read(package, "msg", f"{name}.msg")
    base, _, part = name.partition("_")
    text = _read(package, kind, f"{base}.{kind}")
    if text is None:
        return None
    sections = [section.strip("\n") + "\n" for section in re.split(r"(?m)^---[ \t]*$", text)]
    if kind == "srv" and len(sections) == 2:
        return {"Request": sections[0], "Response": sections[1], "Event": _event(base)}.get(part)
    if kind == "action" and len(sections) == 3:
        return {
            "Goal": sections[0],
            "Result": sections[1],
            "Feedback": sections[2],
            "FeedbackMessage": f"{_UUID}{base}_Feedback feedback\n",
            "SendGoal_Request": f"{_UUID}{base}_Goal goal\n",
            "SendGoal_Response": "bool accepted\nbuiltin_interfaces/Time stamp\n",
            "SendGoal_Event": _event(f"{base}_SendGoal"),
            "GetResult_Request": _UUID,
            "GetResult_Response": f"int8 status\n{base}_Result result\n",
            "GetResult_Event": _event(f"{base}_GetResult"),
        }.get(part)
    return None


def _event(service: str) -> str:
    return (
        "service_msgs/ServiceEventInfo info\n"
        f"{service}_Request[<=1] request\n{service}_Response[<=1] response\n"
    )


def _read(package: str, folder: str, file: str) -> str | None:
    for share in share_folders():
        path = share / package / folder / file
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return None


_INNER = {
    "FeedbackMessage": ("Impl", "FeedbackMessage"),
    "SendGoal_Request": ("Impl", "SendGoalService", "Request"),
    "SendGoal_Response": ("Impl", "SendGoalService", "Response"),
    "SendGoal_Event": ("Impl", "SendGoalService", "Event"),
    "GetResult_Request": ("Impl", "GetResultService", "Request"),
    "GetResult_Response": ("Impl", "GetResultService", "Response"),
    "GetResult_Event": ("Impl", "GetResultService", "Event"),
}


@functools.cache
def message_class(type_name: str) -> Any:
    """Python class of a message type, also of those behind actions and service events.

    The name may come from a file: what is imported by it is a package of messages, whose definition is
    installed, and nothing else.

    Raises:
        DataError: when no such type is installed.
    """
    try:
        if not _TYPE.fullmatch(type_name):
            raise ValueError(type_name)
        package, kind, name = type_name.split("/")
        if _own_text(package, kind, name) is None:
            raise ImportError(type_name)
        module = importlib.import_module(f"{package}.{kind}")
        if kind == "msg":
            return getattr(module, name)
        base, _, part = name.partition("_")
        found = getattr(module, base)
        for attribute in _INNER.get(part, (part,)):
            found = getattr(found, attribute)
        return found
    except (ImportError, AttributeError, ValueError) as error:
        raise DataError(
            f"message type {cut(type_name)} is not installed here",
            hint="build its package into the environment and start again",
        ) from error
