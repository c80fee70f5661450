"""Messages that are sent often and differ in their numbers alone: the numbers are written into bytes.

To build a message of Python objects and to serialise it takes several times as long as to write its
numbers where they are in the serialised message (OMG DDS-XTypes 1.3, 7.4.1: plain CDR), and some topics run
at 250 Hz.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractSequence,
    AbstractString,
    Array,
    BasicType,
    NamespacedType,
)

from hri_prediction.errors import DataError
from hri_prediction.ros.time import NANO

HEAD = 4
"""Bytes in front of a message, which say how it is encoded; alignment counts from behind them."""
KEPT = 16
"""Templates of one topic that are kept."""
_CODES = {
    "boolean": "?", "uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2",
    "uint32": "u4", "int32": "i4", "uint64": "u8", "int64": "i8", "float": "f4", "double": "f8",
}  # fmt: skip


class MessageTemplate:
    """A serialised message whose numbers can be written anew.

    Args:
        message: Its strings and the lengths of its sequences stay as they are.

    Attributes:
        numbers: Views of the bytes by field, ``"header.stamp.sec"`` or ``"position"``: arrays of the
            field's type and length, of length 1 for a single number. Bytes ("octet"), and fields of
            sequences of messages, are not among them.

    Raises:
        DataError: when the middleware does not encode the message as plain CDR.
    """

    def __init__(self, message: Any) -> None:
        self._bytes = bytearray(serialize_message(message))
        walk = _Walk(message)
        self.numbers: Mapping[str, NDArray[Any]] = {
            name: np.frombuffer(self._bytes, code, count, HEAD + offset)
            for name, code, count, offset in walk.fields()
        }
        # Behind the last field there may be room that was reckoned with and not needed.
        for begin, end in (*walk.gaps, (walk.offset, len(self._bytes) - HEAD)):
            # The serializer leaves there what was in its memory; equal messages are to have equal bytes.
            self._bytes[HEAD + begin : HEAD + end] = bytes(end - begin)
        for name, numbers in self.numbers.items():
            if not np.array_equal(numbers, np.ravel(_get(message, name)), equal_nan=True):
                raise DataError(
                    f"{name} of {type(message).__name__} is not where plain CDR has it",
                    expected="a middleware that encodes messages as DDS does",
                )

    def stamp(self, stamp_ns: int, name: str = "header.stamp") -> None:
        """Write a time [ns]; negative ones count as zero."""
        seconds, nanoseconds = divmod(max(int(stamp_ns), 0), NANO)
        self.numbers[f"{name}.sec"][0] = seconds
        self.numbers[f"{name}.nanosec"][0] = nanoseconds

    def write(self, **numbers: Any) -> None:
        """Write fields of the message itself.

        Raises:
            KeyError: when there is no such field.
            ValueError: when there are more, or fewer, numbers than in the message at first.
        """
        for name, values in numbers.items():
            field = self.numbers[name]
            if np.size(values) != field.size:
                raise ValueError(f"{np.size(values)} numbers for {name}, which has {field.size}")
            field[:] = values

    def encoded(self) -> bytes:
        """The message as it is sent."""
        return bytes(self._bytes)


def templates(make: Callable[..., Any]) -> Callable[..., MessageTemplate]:
    """Templates of one topic, by all of its messages that is not a number; the newest few are kept.

    Args:
        make: Makes a message of what is not a number.

    Returns:
        Takes the same, and gives the template.
    """

    @lru_cache(maxsize=KEPT)
    def of(*key: Hashable) -> MessageTemplate:
        return MessageTemplate(make(*key))

    return of


class _Walk:
    """Where the fields of a message are in its serialised form.

    Args:
        message: The message.

    Attributes:
        gaps: Begin and end of what is skipped so that numbers are aligned, as far as it went.
        offset: Where it is.
    """

    def __init__(self, message: Any) -> None:
        self._message = message
        self.offset = 0
        self.gaps: list[tuple[int, int]] = []

    def fields(self) -> Iterator[tuple[str, str, int, int]]:
        """Name, numpy's code of the type, count and offset of each field of numbers."""
        yield from self._of_message("", self._message)

    def _of_message(self, prefix: str, message: Any) -> Iterator[tuple[str, str, int, int]]:
        for name, kind in zip(
            message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True
        ):
            yield from self._of_value(prefix + name, kind, getattr(message, name))

    def _of_value(self, name: str, kind: Any, value: Any) -> Iterator[tuple[str, str, int, int]]:
        if isinstance(kind, BasicType) and kind.typename == "octet":
            self._pass(1, 1)
        elif isinstance(kind, BasicType):
            yield self._numbers(name, kind, 1)
        elif isinstance(kind, AbstractString):
            self._pass(4, 1)
            self.offset += len(str(value).encode()) + 1
        elif isinstance(kind, NamespacedType):
            yield from self._of_message(f"{name}.", value)
        elif isinstance(kind, AbstractNestedType):
            if isinstance(kind, AbstractSequence) and not isinstance(kind, Array):
                self._pass(4, 1)
            if isinstance(kind.value_type, BasicType) and kind.value_type.typename != "octet":
                if len(value):
                    yield self._numbers(name, kind.value_type, len(value))
                return
            for index, item in enumerate(value):
                # Passed, and not offered: their number is no number of the message.
                for _ in self._of_value(f"{name}[{index}]", kind.value_type, item):
                    pass
        else:
            raise DataError(f"{name} is a {type(kind).__name__}", expected="numbers or strings")

    def _pass(self, size: int, count: int) -> int:
        """Go past numbers; where they are."""
        begin = -(-self.offset // size) * size
        if begin > self.offset:
            self.gaps.append((self.offset, begin))
        self.offset = begin + size * count
        return begin

    def _numbers(self, name: str, kind: BasicType, count: int) -> tuple[str, str, int, int]:
        code = np.dtype(_CODES[kind.typename])
        return name, code.str, count, self._pass(code.itemsize, count)


def _get(message: Any, name: str) -> Any:
    for part in name.split("."):
        message = getattr(message, part)
    return message
