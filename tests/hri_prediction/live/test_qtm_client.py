"""The client against a stand-in for QTM over loopback: streams, silence, breaks, refusals."""

import asyncio
import contextlib
import struct
import sys
import time

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.live import qtm_client
from hri_prediction.live.arm_stream import MarkerLayout
from hri_prediction.live.qtm_client import QtmClient, load_qtm_rt
from hri_prediction.live.qtm_server import (
    DATA,
    EVENT,
    SETTINGS_CHANGED,
    SHUTTING_DOWN,
    QtmServer,
    packet,
)

pytest.importorskip("qtm_rt")

NAMES = ("RSHO", "RELB", "RWRA")
PLACES = np.random.default_rng(3).uniform(-900, 900, (50, 3, 3)).astype(np.float32)
PLACES[::7, 1] = np.nan


@pytest.fixture
def server():
    with QtmServer(PLACES, NAMES) as server:
        yield server


@pytest.fixture
def connect(server):
    clients = []

    def start(port=0, **options):
        options = {"silence_s": 0.3, "retry_s": 0.05, "clock": time.time_ns, **options}
        clients.append(QtmClient("127.0.0.1", port or server.port, **options))
        return clients[-1]

    yield start
    for client in clients:
        client.close()
        assert not client._thread.is_alive()


def wait(condition, what, seconds=5.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.005)


def frames(client, count):
    got = []
    wait(lambda: got.extend(client.take()) or len(got) >= count, f"{count} frames")
    return got


def test_stream(server, connect):
    client = connect()
    got = frames(client, 60)
    assert got[0].layout == MarkerLayout(NAMES, 200.0, "+z")
    assert all(frame.layout is got[0].layout for frame in got)
    for frame in got:
        row = frame.number - 1
        np.testing.assert_array_equal(frame.positions, PLACES[row % len(PLACES)])
        assert frame.source_ns == row * 5_000_000
        assert 0 <= time.time_ns() - frame.received_ns < 60 * 10**9
    assert list(np.diff([frame.number for frame in got])) == [1] * (len(got) - 1)
    assert client.problem == ""
    assert server.asked[:3] == [
        "version 1.25",
        "getparameters general 3d",
        "streamframes allframes 3d",
    ]


def test_rate_is_asked_for(server, connect):
    frames(connect(rate_hz=100), 1)
    assert server.asked[-1] == "streamframes frequency:100 3d"


def test_a_cancellation_that_gets_lost_does_not_keep_the_thread(server, connect, monkeypatch):
    """As where an answer comes at the moment at which the client is closed."""

    async def serve(self):
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.sleep(60.0)
        await asyncio.sleep(60.0)

    monkeypatch.setattr(QtmClient, "_serve", serve)
    client, begin = connect(), time.monotonic()
    client.close()
    assert not client._thread.is_alive()
    assert time.monotonic() - begin < 4.0


def test_lost_connection_is_made_anew(server, connect):
    client = connect()
    frames(client, 5)
    server.hang_up()
    wait(lambda: client.problem, "the break is noticed")
    assert "the connection was closed" in client.problem or "broke" in client.problem
    wait(lambda: client.connections == 2, "a second stream")
    client.take()
    frames(client, 5)
    assert client.problem == ""


def test_server_that_dies_and_comes_back(server, connect):
    client = connect()
    frames(client, 5)
    server.close()
    wait(lambda: "cannot connect" in client.problem, "the refusal is told")
    assert f"QTM at 127.0.0.1:{server.port}: " in client.problem
    client.take()
    with QtmServer(PLACES + 1000.0, NAMES[::-1], port=server.port):
        got = frames(client, 5)
        assert got[0].layout.names == NAMES[::-1]
        client.close()


def test_silence_is_noticed_and_ends(server, connect):
    client = connect()
    frames(client, 5)
    server.measuring = False
    wait(lambda: "no frames come" in client.problem, "the silence is told")
    server.measuring = True
    client.take()
    frames(client, 5)
    assert client.problem == ""


def test_nothing_is_measured_at_first(server, connect):
    server.measuring = False
    client = connect()
    wait(lambda: "no frames come; start a measurement" in client.problem, "it is told")
    server.measuring = True
    frames(client, 3)


def test_answers_that_do_not_come(server, connect):
    server.mute = True
    client = connect()
    wait(lambda: "does not answer within 0.3 s" in client.problem, "it is told")
    server.mute = False
    frames(client, 3)


def test_refusals_are_told(server, connect):
    server.refuse = b"Version is not supported"
    client = connect()
    wait(lambda: "refuses: Version is not supported" in client.problem, "it is told")


def test_labels_that_change(server, connect):
    client = connect()
    frames(client, 5)
    server.names = ["a", "b", "c"]
    server.say(SETTINGS_CHANGED)
    got = []
    wait(
        lambda: got.extend(client.take()) or (got and got[-1].layout.names == ("a", "b", "c")),
        "the new labels",
    )
    # More markers than labels, without any event.
    server.places = np.zeros((5, 4, 3))
    wait(lambda: "a frame holds 4 markers, not 3" in client.problem, "it is told")
    server.names = ["a", "b", "c", "d"]
    wait(lambda: got.extend(client.take()) or len(got[-1].layout.names) == 4, "the new labels")


def test_no_labels(server, connect):
    server.names = []
    client = connect()
    wait(lambda: "names no markers" in client.problem, "it is told")


def test_qtm_says_that_it_ends(server, connect):
    client = connect()
    frames(client, 5)
    server.measuring = False
    server.say(SHUTTING_DOWN)
    wait(lambda: client.problem, "it is told")
    assert "QTM says QTMShuttingDown" in client.problem


def test_other_programs_are_not_taken_for_qtm(connect):
    import socketserver
    import threading

    class Web(socketserver.StreamRequestHandler):
        def handle(self):
            self.wfile.write(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Web) as web:
        threading.Thread(target=web.serve_forever, daemon=True).start()
        client = connect(web.server_address[1])
        wait(
            lambda: "is not QTM's protocol: a packet of 1347703880 bytes" in client.problem,
            "it is told",
        )
        client.close()
        web.shutdown()


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (bytes(8), "a packet of 0 bytes"),
        (struct.pack("<II", 4, DATA), "a packet of 4 bytes"),
        (packet(77, b""), "a packet of 8 bytes and type 77"),
        (packet(EVENT, b""), "an event of 0 bytes"),
        (packet(EVENT, b"\x63"), "ValueError: 99 is not a valid QRTEvent"),
        (packet(DATA, b"abc"), "a frame of 3 bytes"),
        (packet(DATA, struct.pack("<qIIII", 0, 1, 2**32 - 1, 0, 1)), "a component of 0 bytes"),
        (packet(DATA, struct.pack("<qIIII", 0, 1, 1, 9, 1)), "a component of 9 bytes"),
        (packet(DATA, struct.pack("<qIIIIIhh", 0, 1, 1, 16, 1, 2**32 - 1, 0, 0)), "error"),
    ],
)
def test_what_is_no_packet_ends_the_connection_and_nothing_else(
    server, connect, sent, said, caplog
):
    """Sizes of 0 among them, which would keep the client in a loop for ever."""
    client = connect(retry_s=0.3)
    frames(client, 3)
    server.measuring = False
    time.sleep(0.05)  # what is on its way
    server._clients[-1].sendall(sent)
    wait(lambda: f"what comes is not QTM's protocol: {said}" in client.problem, "it is told")
    server.measuring = True
    client.take()
    frames(client, 3)
    assert client.connections == 2
    assert "Traceback" not in caplog.text


def fail_once(function):
    """The function, which raises something that nobody expects when it is called for the first time."""
    calls = []

    def call(*args):
        calls.append(args)
        if len(calls) == 1:
            raise ZeroDivisionError("something odd")
        return function(*args)

    return call


def test_what_nobody_expects_does_not_end_it(server, connect, monkeypatch, caplog):
    monkeypatch.setattr(qtm_client, "read_layout", fail_once(qtm_client.read_layout))
    client = connect(retry_s=0.2)
    wait(lambda: "ZeroDivisionError: something odd" in client.problem, "the problem")
    frames(client, 5)
    assert client.problem == ""
    assert client.failures == 1
    assert client.alive
    assert "something odd" in caplog.text


def test_what_goes_wrong_with_a_frame_is_told(server, connect, caplog):
    client = connect(retry_s=0.2, clock=fail_once(time.time_ns))
    wait(lambda: "ZeroDivisionError: something odd" in client.problem, "the problem")
    frames(client, 5)
    assert client.problem == ""
    assert client.connections == 2
    assert "something odd" in caplog.text


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "qtm_rt", None)
    with pytest.raises(ConfigError, match=r"needs qtm-rt, .*pip install -r requirements/qualisys"):
        load_qtm_rt()
