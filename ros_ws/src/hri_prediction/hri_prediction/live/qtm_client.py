"""Client of Qualisys Track Manager's real-time protocol, in a thread of its own, through qtm-rt.

It connects, asks for the markers, streams, and begins anew when the stream ends, falls silent, or QTM's
settings change. Needs no ROS. QTM sends what is missing as NaN, and lengths in millimetres.
"""

from __future__ import annotations

import asyncio
import logging
import struct
import threading
from collections import deque
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.live.arm_stream import MarkerLayout
from hri_prediction.live.qtm import QtmFrame, read_layout
from hri_prediction.live.qtm_packets import PacketSplitter

_LOG = logging.getLogger(__name__)
VERSION = "1.25"
"""Version of the protocol; QTM since 2023 speaks it, and later ones too."""
_CANCEL_S = 0.05
"""Between two attempts to cancel the connection, when the client is closed [s]."""
_MOST_WAITING = 1000
"""Frames that wait to be taken; older ones are dropped."""
_ENDS_STREAM = frozenset(
    (
        "EventConnectionClosed",
        "EventQTMShuttingDown",
        "EventCameraSettingsChanged",
        "EventRTfromFileStopped",
    )
)


def load_qtm_rt() -> ModuleType:
    """The module ``qtm_rt``.

    Raises:
        ConfigError: when it is not installed.
    """
    try:
        import qtm_rt
    except ImportError as error:
        raise ConfigError(
            "live motion capture from Qualisys needs qtm-rt, which is not installed",
            hint="run: .venv/bin/python -m pip install -r requirements/qualisys.txt",
        ) from error
    return qtm_rt


class QtmClient:
    """Receives frames from QTM as long as it is open.

    Args:
        host: Name or address of the computer that QTM runs on.
        port: Its port for little-endian clients.
        rate_hz: Frames a second that are asked for; 0 for all.
        silence_s: Longest time without an answer or a frame before the connection is made anew [s].
        retry_s: Time between attempts [s].
        clock: The time now [ns]; called in the client's thread.

    Raises:
        ConfigError: when qtm-rt is not installed.
    """

    def __init__(
        self,
        host: str,
        port: int,
        *,
        rate_hz: int = 0,
        silence_s: float = 1.0,
        retry_s: float = 0.5,
        clock: Callable[[], int],
    ) -> None:
        self._qtm = load_qtm_rt()
        self._host, self._port = host, port
        self._frames_wanted = f"frequency:{rate_hz}" if rate_hz else "allframes"
        self._silence_s, self._retry_s = silence_s, retry_s
        self._clock = clock
        self._frames: deque[QtmFrame] = deque(maxlen=_MOST_WAITING)
        self._loop = asyncio.new_event_loop()
        self._task: asyncio.Task[None] | None = None
        self._session: _Session | None = None
        self._thread = threading.Thread(target=self._work, name="qtm", daemon=True)
        self.problem = f"connecting to QTM at {host}:{port}"
        """Why no frames come; empty while they do."""
        self.connections = 0
        """Streams that were begun."""
        self.failures = 0
        """Attempts that failed, and streams that ended."""
        self._thread.start()

    def take(self) -> list[QtmFrame]:
        """The frames that have come since the last call, oldest first."""
        frames = []
        while self._frames:
            frames.append(self._frames.popleft())
        return frames

    @property
    def alive(self) -> bool:
        """Whether the thread runs; without it no frames come any more."""
        return self._thread.is_alive()

    def close(self) -> None:
        """End the connection and the thread."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._cancel)
            self._thread.join(timeout=5.0)

    # ------------------------------------------------------------------ in the thread
    def _cancel(self) -> None:
        if self._task is not None and not self._task.done():
            self._task.cancel()
            # Until it has ended: a wait (asyncio's, in Python 3.11) whose answer comes at the same moment
            # goes on as if nobody had cancelled it.
            self._loop.call_later(_CANCEL_S, self._cancel)

    def _work(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.set_exception_handler(self._on_error)
        self._task = self._loop.create_task(self._serve())
        try:
            self._loop.run_until_complete(self._task)
        except asyncio.CancelledError:
            pass
        finally:
            # Lets closed transports go.
            self._loop.run_until_complete(asyncio.sleep(0.0))
            self._loop.close()

    def _on_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """What goes wrong in a callback ends the connection, which is then made anew."""
        error = context.get("exception")
        _LOG.error("receiving from QTM: %s", context.get("message"), exc_info=error)
        if "future" in context:
            return  # of a connection that has ended already
        if self._session is not None:
            self._session.end(_described(error) if error else str(context.get("message")))

    async def _serve(self) -> None:
        where = f"QTM at {self._host}:{self._port}"
        while True:
            try:
                self._session = _Session(self._qtm, self)
                await self._session.run()
            except TimeoutError:
                self.problem = f"{where} does not answer within {self._silence_s:g} s"
            except OSError as error:
                reason = error.strerror or str(error)
                self.problem = f"cannot connect to {where}: {reason}"
            except self._qtm.QRTCommandException as error:
                self.problem = f"{where} refuses: {_text(error.value)}"
            except DataError as error:
                self.problem = f"{where}: {error}"
            except Exception as error:
                # Whatever it is: a thread that ended here would leave the robot's people unseen, unsaid.
                self.problem = f"{where}: {_described(error)}"
                _LOG.exception("receiving from QTM")
            self.failures += 1
            await asyncio.sleep(self._retry_s)


class _Session:
    """One connection, from the first byte to its end."""

    def __init__(self, qtm: ModuleType, client: QtmClient) -> None:
        self._qtm = qtm
        self._client = client
        self._layout = MarkerLayout(())
        self._received = 0
        self._streaming = False
        self._ended = asyncio.Event()
        self._reason = "the connection was closed"

    async def run(self) -> None:
        """Stream until the connection ends.

        Raises:
            DataError: saying why it ended.
            OSError, TimeoutError, QRTCommandException: from connecting and asking.
        """
        client = self._client
        loop = asyncio.get_running_loop()
        timeout = client._silence_s
        # Not qtm_rt.connect: it hides why a connection fails, and waits for ever for an answer.
        protocol = self.protocol(loop)
        try:
            await asyncio.wait_for(
                loop.create_connection(lambda: protocol, client._host, client._port), timeout
            )
            await asyncio.wait_for(protocol.set_version(VERSION), timeout)
            connection = self._qtm.QRTConnection(protocol, timeout)
            self._layout = read_layout(await connection.get_parameters(["general", "3d"]))
            try:
                await connection.stream_frames(client._frames_wanted, ["3d"], self._on_packet)
            except TimeoutError:
                raise DataError(self._reason if self._ended.is_set() else _SILENT) from None
            self._streaming = True
            client.connections += 1
            await self._watch(timeout)
        except (TimeoutError, self._qtm.QRTCommandException):
            if self._ended.is_set():  # and so nothing was answered
                raise DataError(self._reason) from None
            raise
        finally:
            if protocol.transport is not None:
                protocol.transport.close()

    def protocol(self, loop: asyncio.AbstractEventLoop) -> Any:
        """qtm-rt's protocol, which is given whole packets only, that fit what they say of themselves."""
        protocol = self._qtm.protocol.QTMProtocol(
            loop=loop, on_event=self._on_event, on_disconnect=self._on_disconnect
        )
        splitter, take = PacketSplitter(), protocol.data_received

        def receive(received: bytes) -> None:
            if self._ended.is_set():
                return
            try:
                for packet in splitter.feed(received):
                    take(packet)
            except (DataError, struct.error, ValueError) as error:
                # The last two: what qtm-rt says of types that it does not know, and of numbers that lack.
                known = str(error) if isinstance(error, DataError) else _described(error)
                self.end(f"what comes is not QTM's protocol: {known}")
                if protocol.transport is not None:
                    protocol.transport.close()

        protocol.data_received = receive
        return protocol

    async def _watch(self, timeout: float) -> None:
        """Return by raising, when the stream ends or falls silent."""
        while True:
            before = self._received
            try:
                await asyncio.wait_for(self._ended.wait(), timeout)
            except TimeoutError:
                if self._received == before:
                    raise DataError(_SILENT) from None
                continue
            raise DataError(self._reason)

    def _on_packet(self, packet: Any) -> None:
        received_ns = self._client._clock()
        found = packet.get_3d_markers()
        if found is None:
            return
        positions = np.array(found[1], dtype=np.float64).reshape(-1, 3)
        if len(positions) != len(self._layout.names):
            self.end(f"a frame holds {len(positions)} markers, not {len(self._layout.names)}")
            return
        self._received += 1
        self._client.problem = ""
        self._client._frames.append(
            QtmFrame(
                layout=self._layout,
                number=int(packet.framenumber),
                source_ns=int(packet.timestamp) * 1000,
                received_ns=received_ns,
                positions=positions,
            )
        )

    def _on_event(self, event: Any) -> None:
        # What is said before the stream begins is of the past.
        if self._streaming and event.name in _ENDS_STREAM:
            self.end(f"QTM says {event.name.removeprefix('Event')}")

    def _on_disconnect(self, error: Exception | None) -> None:
        broke = f"the connection broke: {_described(error)}" if error else ""
        self.end(broke or "the connection was closed")

    def end(self, reason: str) -> None:
        """End the connection; the first reason counts."""
        if not self._ended.is_set():
            self._reason = reason
            self._ended.set()


_SILENT = "connected, but no frames come; start a measurement, or real-time output from a file"


def _described(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
