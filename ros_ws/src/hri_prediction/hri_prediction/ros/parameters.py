"""ROS parameters from configuration dataclasses: one source for names, defaults, units and ranges."""

from __future__ import annotations

import dataclasses
import difflib
import typing
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from hri_prediction.config import from_mapping
from hri_prediction.errors import ConfigError, all_of

ConfigT = TypeVar("ConfigT")

# rclpy wants both ends of a range.
_UNBOUNDED_FLOAT = 1e12
_UNBOUNDED_INT = 2**53
_ARRAYS = {
    bool: Parameter.Type.BOOL_ARRAY,
    int: Parameter.Type.INTEGER_ARRAY,
    float: Parameter.Type.DOUBLE_ARRAY,
    str: Parameter.Type.STRING_ARRAY,
}


def _descriptor(field: dataclasses.Field[Any], kind: Any) -> ParameterDescriptor:
    meta = field.metadata
    unit = f" [{meta['unit']}]" if meta["unit"] else ""
    descriptor = ParameterDescriptor(description=f"{meta['doc']}{unit}", read_only=True)
    low, high = meta["low"], meta["high"]
    if kind is float and not (low is None and high is None):
        descriptor.floating_point_range = [
            FloatingPointRange(
                from_value=float(-_UNBOUNDED_FLOAT if low is None else low),
                to_value=float(_UNBOUNDED_FLOAT if high is None else high),
            )
        ]
    elif kind is int and not (low is None and high is None):
        descriptor.integer_range = [
            IntegerRange(
                from_value=int(-_UNBOUNDED_INT if low is None else low),
                to_value=int(_UNBOUNDED_INT if high is None else high),
                step=1,
            )
        ]
    if meta["choices"]:
        descriptor.additional_constraints = "one of: " + ", ".join(meta["choices"])
    return descriptor


def declare_config(
    node: Node, cls: type[ConfigT], *, prefix: str = "", defaults: ConfigT | None = None
) -> ConfigT:
    """Declare every field of a configuration as a read-only parameter and return what was set.

    Args:
        node: The node that gets the parameters.
        cls: Frozen dataclass made of :func:`hri_prediction.config.parameter` fields.
        prefix: Put before each name, with a dot (``scene`` → ``scene.radius``).
        defaults: Values to use where nothing was set; ``cls()`` when not given.

    Raises:
        ConfigError: when values that were set are out of range or of the wrong type: all of them.
    """
    values: dict[str, Any] = {}
    faults: list[ConfigError] = []
    hints = typing.get_type_hints(cls)
    base = defaults if defaults is not None else cls()
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        if "doc" not in field.metadata:
            continue
        name = f"{prefix}.{field.name}" if prefix else field.name
        default = getattr(base, field.name)
        if isinstance(default, tuple):
            # rclpy cannot tell the type of an empty list: then declare the type alone.
            default = list(default) or _ARRAYS[typing.get_args(hints[field.name])[0]]
        try:
            value = node.declare_parameter(
                name, default, _descriptor(field, hints[field.name])
            ).value
        except (InvalidParameterTypeException, InvalidParameterValueException) as error:
            text = " ".join(str(error).split())
            faults.append(ConfigError(f"parameter {name} of node {node.get_name()}: {text}"))
            continue
        if value is None:
            value = []
        values[field.name] = value if isinstance(value, str | int | float) else list(value)
    if faults:
        raise all_of("", faults)
    return from_mapping(cls, values)


def refuse_undeclared(node: Node) -> None:
    """Refuse parameter values that no parameter of the node takes: a misspelled margin is no margin.

    Raises:
        ConfigError: naming the first one and those that are spelled alike.
    """
    for name in node._parameter_overrides:
        if node.has_parameter(name) or name.startswith("qos_overrides."):
            continue
        known = [str(other) for other in node._parameters]
        near = difflib.get_close_matches(name, known, 3)
        raise ConfigError(
            f"node {node.get_name()} has no parameter {name!r}",
            expected="one like " + ", ".join(near)
            if near
            else "one of " + ", ".join(sorted(known)),
        )
