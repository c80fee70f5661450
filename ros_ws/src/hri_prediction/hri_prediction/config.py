"""Configuration as data: frozen dataclasses whose fields know their meaning, unit and range.

The same dataclass is what a core takes, what a YAML file fills, and what a node declares as ROS
parameters (:mod:`hri_prediction.ros.parameters`).
"""

from __future__ import annotations

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from hri_prediction.errors import ConfigError, all_of, cut, shown
from hri_prediction.files.values import read_yaml

ConfigT = TypeVar("ConfigT")


def parameter(
    default: Any,
    doc: str,
    *,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field with documentation, unit and closed range.

    Args:
        default: Default value: bool, int, float, str, or a tuple of one of these.
        doc: What it is and what turning it does.
        unit: SI unit, empty for pure numbers.
        low: Smallest allowed value (of every element for tuples).
        high: Largest allowed value.
        choices: Allowed strings.
    """
    metadata = {"doc": doc, "unit": unit, "low": low, "high": high, "choices": choices}
    return dataclasses.field(default=default, metadata=metadata)


def validate(config: Any) -> None:
    """Check all fields made by :func:`parameter`; call it from ``__post_init__``.

    Raises:
        ConfigError: naming each field that is wrong, its value and what is allowed.
    """
    faults = []
    for field in dataclasses.fields(config):
        if "doc" in field.metadata:
            value = getattr(config, field.name)
            expected = _out_of_range(value, field.metadata)
            if expected:
                where = f"{type(config).__name__}.{field.name} = {shown(value)}"
                faults.append(ConfigError(where, expected=expected))
    if faults:
        raise all_of("", faults)


def _out_of_range(value: Any, meta: Mapping[str, Any]) -> str:
    """What would have been right; empty: it is."""
    for item in value if isinstance(value, tuple) else (value,):
        if isinstance(item, float) and not math.isfinite(item):
            return "a finite number"
        if meta["low"] is not None and item < meta["low"]:
            return f"at least {meta['low']} {meta['unit']}".strip()
        if meta["high"] is not None and item > meta["high"]:
            return f"at most {meta['high']} {meta['unit']}".strip()
        if meta["choices"] and item not in meta["choices"]:
            return "one of " + ", ".join(meta["choices"])
    return ""


def _coerce(name: str, value: Any, annotation: Any) -> Any:
    """Bring a YAML value to the annotated type, refusing anything lossy."""
    origin = typing.get_origin(annotation)
    if origin in (types.UnionType, typing.Union):
        if value is None:
            return None
        annotation = next(a for a in typing.get_args(annotation) if a is not type(None))
        origin = typing.get_origin(annotation)
    if origin is tuple:
        if not isinstance(value, (list, tuple)):
            raise ConfigError(f"{name} = {shown(value)}", expected="a list")
        args = typing.get_args(annotation)
        if len(args) == 2 and args[1] is Ellipsis:
            return tuple(_coerce(name, item, args[0]) for item in value)
        if len(args) != len(value):
            raise ConfigError(f"{name} has {len(value)} elements", expected=f"{len(args)}")
        return tuple(_coerce(name, item, arg) for item, arg in zip(value, args, strict=True))
    if annotation is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError as error:
            raise ConfigError(f"{name} = {shown(value)}", expected="a finite number") from error
    if annotation in (bool, int, str) and type(value) is annotation:
        return value
    if annotation is float or annotation in (bool, int, str):
        raise ConfigError(
            f"{name} = {shown(value)}",
            expected=f"a value of type {annotation.__name__}",
            hint=_yaml_hint(value) if annotation is float else "",
        )
    return value


def _yaml_hint(value: Any) -> str:
    """What is wrong with a number that YAML takes for text, such as 1e3."""
    try:
        float(value)
    except (TypeError, ValueError):
        return ""
    return "YAML takes that for text: write a point, and the exponent with its sign, as in 1.0e+3"


def from_mapping(cls: type[ConfigT], values: Mapping[str, Any]) -> ConfigT:
    """Build a configuration, leaving what is not given at its default.

    Raises:
        ConfigError: on unknown names (the valid ones are listed), wrong types and ranges: all of them.
    """
    hints = typing.get_type_hints(cls)
    names = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    faults = []
    unknown = sorted(map(str, set(values) - set(names)))
    if unknown:
        faults.append(
            ConfigError(
                f"{cls.__name__} has no parameter {cut(', '.join(unknown))}",
                expected="one of " + ", ".join(names),
            )
        )
    usable = {}
    for name in (name for name in names if name in values):
        try:
            usable[name] = _coerce(name, values[name], hints[name])
        except ConfigError as error:
            faults.append(error)
    try:
        made = cls(**usable)
    except ConfigError as error:
        # With some values at their defaults, only what is said of single ones is sure.
        own = [f for f in error.faults if f.problem.startswith(f"{cls.__name__}.")]
        raise all_of("", faults + own if faults else list(error.faults)) from error
    if faults:
        raise all_of("", faults)
    return made


def load_yaml(cls: type[ConfigT], path: str | Path) -> ConfigT:
    """Read a configuration from a flat YAML file.

    Raises:
        ConfigError: when the file is missing, is no YAML mapping, or holds unusable values; all of
            them are named.
    """
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise ConfigError(f"{path} holds {type(values).__name__}", expected="a YAML mapping")
    try:
        return from_mapping(cls, values)
    except ConfigError as error:
        raise all_of(str(path), error.faults) from error
