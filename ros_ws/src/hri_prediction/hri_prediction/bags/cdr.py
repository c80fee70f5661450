"""The few bytes of a serialised message that are read or changed without its message class.

A CDR message begins with four bytes that name the encoding (the second is 1 for little-endian);
a leading ``std_msgs/Header`` then has its stamp in the next eight: int32 seconds, uint32
nanoseconds. So stamps are read and re-based without deserialising anything.
"""

from __future__ import annotations

import struct

_PREFIX = 4
_STAMP = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_STAMPED = ("std_msgs/Header", "std_msgs/msg/Header", "builtin_interfaces/Time")


def starts_with_stamp(definition: str) -> bool:
    """Whether the first field of a ros2msg definition is a header or a time."""
    for line in definition.splitlines():
        text = line.split("#", 1)[0].strip()
        if text.startswith("===="):
            break
        if text and "=" not in text:
            return text.split()[0] in _STAMPED
    return False


def read_stamp(data: bytes) -> int | None:
    """Stamp [ns] of a message that starts with one, None when the message is too short."""
    if len(data) < _PREFIX + 8 or data[1] not in _STAMP:
        return None
    seconds, nanoseconds = _STAMP[data[1]].unpack_from(data, _PREFIX)
    return int(seconds) * 10**9 + int(nanoseconds)


def with_stamp(data: bytes, stamp_ns: int) -> bytes:
    """The same message with another stamp [ns]; only for types that start with one."""
    if read_stamp(data) is None:
        return data
    stamp = _STAMP[data[1]].pack(*divmod(stamp_ns, 10**9))
    return data[:_PREFIX] + stamp + data[_PREFIX + 8 :]
