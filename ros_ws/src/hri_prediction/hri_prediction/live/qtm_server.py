"""A small stand-in for QTM: the real-time protocol (version 1.25, little-endian) over loopback.

For tests, and for trying what comes of a source that dies, where there is no QTM. Packets are put together
here by the protocol's description, not with the client's structures.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from hri_prediction.closing import Closing

FloatArray = NDArray[np.float64]

ERROR, COMMAND, XML, DATA, NO_MORE, EVENT = 0, 1, 2, 3, 4, 6
"""Types of packets."""
SETTINGS_CHANGED, SHUTTING_DOWN = 11, 12
"""Events."""


def packet(kind: int, body: bytes) -> bytes:
    """Size and type, then the body."""
    return struct.pack("<II", 8 + len(body), kind) + body


def data_packet(number: int, time_us: int, places: FloatArray) -> bytes:
    """One frame with one component, 3D; places (M, 3) [mm], NaN where a marker is missing."""
    markers = np.asarray(places, "<f4").tobytes()
    component = struct.pack("<IIIhh", 16 + len(markers), 1, len(places), 0, 0) + markers
    return packet(DATA, struct.pack("<qII", time_us, number, 1) + component)


class QtmServer(Closing):
    """Streams an array in a loop to everybody who asks, and does what it is told to do wrong.

    Args:
        places: Shape (N, M, 3) [mm].
        names: Names of the markers.
        rate_hz: Frames a second.
        up: AxisUpwards.
        port: 0 for any that is free.

    Attributes:
        port: The one that it listens on.
        measuring: Whether there are frames.
        mute: Whether nothing is answered.
        refuse: Answer to every command, as an error; empty: none is refused.
        begin: Begin of the measurement, of ``time.monotonic()`` [s].
        asked: Commands that have come.
        sent: Frames that were sent.
    """

    def __init__(
        self,
        places: FloatArray,
        names: Sequence[str],
        *,
        rate_hz: float = 200.0,
        up: str = "+Z",
        port: int = 0,
    ) -> None:
        self.places, self.names, self.rate_hz, self.up = places, list(names), rate_hz, up
        self.measuring = True
        self.mute = False
        self.refuse = b""
        self.begin = time.monotonic()
        self.asked: list[str] = []
        self.sent = 0
        self._clients: list[socket.socket] = []
        self._closing = False
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port = self._listener.getsockname()[1]
        self._threads: list[threading.Thread] = []
        self._start(self._accept)

    def close(self) -> None:
        """Hang up and listen no more."""
        if self._closing:
            return
        self._closing = True
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.hang_up()
        for thread in self._threads:
            thread.join(timeout=5.0)

    def hang_up(self) -> None:
        """Break all connections, as when QTM is closed."""
        for client in self._clients:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)
        self._clients.clear()

    def say(self, event: int) -> None:
        """Send an event to everybody."""
        for client in self._clients:
            client.sendall(packet(EVENT, bytes([event])))

    def restart(self) -> None:
        """Begin a new measurement: its times begin at zero."""
        self.begin = time.monotonic()

    def parameters(self) -> str:
        """The answer to GetParameters General 3D."""
        labels = "".join(
            f"<Label><Name>{escape(n)}</Name><RGBColor>255</RGBColor></Label>" for n in self.names
        )
        return (
            f"<QTM_Parameters_Ver_1.25>\r\n<General><Frequency>{self.rate_hz:g}</Frequency></General>"
            f"<The_3D><AxisUpwards>{self.up}</AxisUpwards><Labels>{len(self.names)}</Labels>"
            f"{labels}</The_3D>\r\n</QTM_Parameters_Ver_1.25>"
        )

    # ------------------------------------------------------------------ threads
    def _start(self, work: Callable[..., None], *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while not self._closing:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients.append(client)
            self._start(self._serve, client)

    def _serve(self, client: socket.socket) -> None:
        try:
            client.sendall(packet(COMMAND, b"QTM RT Interface connected\0"))
            while True:
                size, kind = struct.unpack("<II", self._exactly(client, 8))
                text = self._exactly(client, size - 8).rstrip(b"\0").decode()
                assert kind == COMMAND
                self.asked.append(text)
                if not self.mute:
                    self._answer(client, text.lower())
        except OSError:
            pass
        finally:
            client.close()

    def _exactly(self, client: socket.socket, count: int) -> bytes:
        got = b""
        while len(got) < count:
            part = client.recv(count - len(got))
            if not part:
                raise OSError("the client has gone")
            got += part
        return got

    def _answer(self, client: socket.socket, text: str) -> None:
        if self.refuse:
            client.sendall(packet(ERROR, self.refuse + b"\0"))
        elif text.startswith("version "):
            client.sendall(packet(COMMAND, f"Version set to {text[8:]}\0".encode()))
        elif text.startswith("getparameters"):
            client.sendall(packet(XML, self.parameters().encode() + b"\0"))
        elif text == "streamframes stop":
            pass
        elif text.startswith("streamframes"):
            if self.measuring:
                self._start(self._stream, client)
            else:
                client.sendall(packet(NO_MORE, b""))
        else:
            client.sendall(packet(ERROR, b"Parse error\0"))

    def _stream(self, client: socket.socket) -> None:
        number = int((time.monotonic() - self.begin) * self.rate_hz)
        try:
            while not self._closing:
                begin = self.begin
                due = begin + number / self.rate_hz
                wait = due - time.monotonic()
                if wait > 0:
                    time.sleep(wait)
                if self.begin != begin:
                    number = 0
                    continue
                if self.measuring:
                    whole = data_packet(
                        number + 1,
                        round(number * 1e6 / self.rate_hz),
                        self.places[number % len(self.places)],
                    )
                    # In two parts: the client must put packets together.
                    client.sendall(whole[:11])
                    client.sendall(whole[11:])
                    self.sent += 1
                number += 1
        except OSError:
            pass
