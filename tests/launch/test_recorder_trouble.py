"""A recorder that gets into trouble while the robot moves: its user hears of it, the run goes on."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from launched import Launched, dropped
from rosbags.rosbag2 import Reader

from hri_prediction.bags.salvage import salvage

Launch = Callable[..., Launched]
BUFFER = 4 * 1024 * 1024
"""Of the loopback transport's sockets [bytes]."""
LOST = 100
"""So many messages are too many to be all of topics that nobody records."""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 8 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=8m", "tmpfs", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)


def test_a_disk_that_gets_full(launch: Launch, disk: Path, tmp_path: Path) -> None:
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text("recorder: {min_free_megabytes: 0}\n")
    options = ("--record", str(disk / "bag"), "--parameters", str(parameters))
    # Reaches enough that the recorder has given up before the last is over.
    run = launch("--reaches", "4", "--seed", "100", "--no-picture", *options)
    run.wait_for("reach 1/4")
    time.sleep(1.0)
    with contextlib.suppress(OSError), (disk / "filler").open("wb", buffering=0) as filler:
        while True:
            filler.write(bytes(4096))
    full = time.monotonic()
    run.wait_for("recorder: not writing: cannot write to", 2.0)
    print(f"said {time.monotonic() - full:.2f} s after the disk was full")
    run.wait_for("the run goes on; its last words: recorder: ", 5.0)
    assert "No space left on device" in run.text
    assert run.end() == 0, run.text
    assert "does not hold all that was sent" in run.text
    assert "Traceback" not in run.text
    salvage(disk / "bag", tmp_path / "salvaged")
    with Reader(tmp_path / "salvaged") as reader:
        assert reader.message_count > 500


def test_a_recorder_that_hangs(launch: Launch) -> None:
    run = launch("--reaches", "4", "--seed", "100", "--no-picture")
    run.wait_for("reach 1/4")
    recorder = run.nodes()["recorder"]
    before = dropped(recorder)
    recorder.send_signal(signal.SIGSTOP)
    try:
        told = f"recorder does not answer: process {recorder.pid} is stopped by a signal"
        run.wait_for(told, 10.0)
        # How long that takes hangs on how large the socket's buffer may be, and how quick the graph is.
        run.wait_until(lambda: dropped(recorder) > before + LOST)
    finally:
        recorder.send_signal(signal.SIGCONT)
    assert run.end() == 0, run.text
    assert "messages were sent and are not in" in run.text


def test_a_recorder_that_is_held_up_loses_nothing(launch: Launch) -> None:
    """As by a host that takes the processors away, or by somebody who compiles beside it."""
    limit = int(Path("/proc/sys/net/core/rmem_max").read_text())
    if limit < BUFFER:
        pytest.skip(f"net.core.rmem_max = {limit} keeps the socket from holding {BUFFER} bytes")
    run = launch("--reaches", "2", "--seed", "100", "--no-picture")
    for reach in (1, 2):
        run.wait_for(f"reach {reach}/2")
        recorder = run.nodes()["recorder"]
        recorder.send_signal(signal.SIGSTOP)
        time.sleep(0.4)
        recorder.send_signal(signal.SIGCONT)
    assert run.end() == 0, run.text
    assert "messages were sent and are not in" not in run.text
