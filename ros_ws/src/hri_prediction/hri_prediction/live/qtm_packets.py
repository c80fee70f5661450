"""Packets of QTM's real-time protocol, little-endian: cut out of what is received, and checked.

qtm-rt believes the sizes that it is sent. A packet, or a part of one, of size 0 keeps it in a loop in which
nothing else is done, not even to notice that frames no longer come; so nothing reaches it unchecked.
"""

from __future__ import annotations

import struct

from hri_prediction.errors import DataError

_HEADER = struct.Struct("<II")
"""Size and type: of a packet with them, and of a component with them."""
_FRAME = struct.Struct("<qII")
"""Time, number and components of a frame."""
_MOST = 1 << 24
"""Largest packet [bytes]: thousands of markers have a hundredth of it, all settings of QTM a tenth."""
_TYPES = range(9)
_DATA, _EVENT = 3, 6


class PacketSplitter:
    """Makes whole packets of a stream of bytes."""

    def __init__(self) -> None:
        self._begun = bytearray()

    def feed(self, received: bytes) -> list[bytes]:
        """The packets that are whole with what was received, headers included.

        Raises:
            DataError: what comes is no packet; the stream is of no use any more.
        """
        self._begun += received
        whole = []
        while len(self._begun) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._begun)
            if not _HEADER.size <= size <= _MOST or kind not in _TYPES:
                raise DataError(
                    f"a packet of {size} bytes and type {kind}",
                    expected=f"{_HEADER.size} to {_MOST} bytes and a type below {len(_TYPES)}",
                    hint="check that host and port are those of QTM's real-time server, little-endian",
                )
            if len(self._begun) < size:
                break
            packet = bytes(self._begun[:size])
            del self._begun[:size]
            check_packet(packet, kind)
            whole.append(packet)
        return whole


def check_packet(packet: bytes, kind: int) -> None:
    """Compare what a packet says of its parts with its size.

    Raises:
        DataError: they do not fit.
    """
    body = len(packet) - _HEADER.size
    if kind == _EVENT and body != 1:
        raise DataError(f"an event of {body} bytes", expected="one")
    if kind != _DATA:
        return
    if body < _FRAME.size:
        raise DataError(f"a frame of {body} bytes", expected=f"{_FRAME.size} at least")
    count = _FRAME.unpack_from(packet, _HEADER.size)[2]
    at = _HEADER.size + _FRAME.size
    for _ in range(count):
        size = _HEADER.unpack_from(packet, at)[0] if at + _HEADER.size <= len(packet) else 0
        if not _HEADER.size <= size <= len(packet) - at:
            raise DataError(
                f"a component of {size} bytes in the {len(packet) - at} that are left of a frame",
                expected=f"at least {_HEADER.size}, and no more than are left",
            )
        at += size
