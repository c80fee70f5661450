"""Recorders in trouble: disks that get full, folders that cannot be written, many messages."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import ByteMultiArray

from hri_prediction.bags import BagReader, salvage
from hri_prediction.errors import HriError
from hri_prediction.ros.time import NANO
from hri_sim.recording.benchmark import benchmark_recorder
from hri_sim.reliability.fault import PROCESSES, Fault, Figure, Place, Skipped, Trial

TOPIC = "/noise"
MESSAGE_BYTES = 8192
RATE_HZ, SECONDS, SMOKE_SECONDS = 5000.0, 60.0, 2.0
LAUNCH = ("scripts", "launch_ptomp.py")
"""A launch script, in the folder of the project."""


@contextlib.contextmanager
def small_disk(folder: Path, megabytes: int) -> Iterator[Path]:
    """A disk of some megabytes.

    Raises:
        Skipped: when none can be mounted here.
    """
    folder.mkdir(parents=True)
    command = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise Skipped(f"a small disk cannot be mounted here: {error}") from error
    if done.returncode:
        raise Skipped(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def _payload(rng: np.random.Generator, number: int) -> bytes:
    """CDR of a ``std_msgs/ByteMultiArray``: a number, and noise that no compression makes smaller."""
    head = b"\x00\x01\x00\x00" + bytes(8) + MESSAGE_BYTES.to_bytes(4, "little")
    return head + number.to_bytes(8, "little") + rng.bytes(MESSAGE_BYTES - 8)


def full_disk(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """A recorder on a small disk, and a source that fills it."""
    for seed in seeds:
        rng = np.random.default_rng(seed)
        with small_disk(place.folder / f"disk_{seed}", int(rng.integers(2, 7))) as disk:
            yield _fill(disk, rng, seed, place.folder / f"salvaged_{seed}")


def _fill(disk: Path, rng: np.random.Generator, seed: int, out: Path) -> Trial:
    bag = disk / "bag"
    parameters = ("output:=" + str(bag), "flush_period:=0.1", "min_free_megabytes:=0")
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "hri_sim.nodes.recorder_node", "--ros-args"),
            *(word for one in parameters for word in ("-p", one)),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    context = Context()
    rclpy.init(context=context)
    node = Node("talker", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    heard: list[tuple[int, str]] = []

    def hear(message: DiagnosticArray) -> None:
        heard.extend(
            (time.time_ns(), status.message)
            for status in message.status
            if status.level == DiagnosticStatus.ERROR
        )

    node.create_subscription(DiagnosticArray, "/diagnostics", hear, 10)
    publisher = node.create_publisher(ByteMultiArray, TOPIC, 1000)
    number, end = 0, time.monotonic() + 60.0
    try:
        while publisher.get_subscription_count() == 0 and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
        while process.poll() is None and time.monotonic() < end:
            publisher.publish(_payload(rng, number))
            number += 1
            executor.spin_once(timeout_sec=0.005)
        # What it said at last may still be on its way.
        for _ in range(20):
            executor.spin_once(timeout_sec=0.02)
    finally:
        if process.poll() is None:
            process.kill()
        output, _ = process.communicate()
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    salvage(bag, out)
    found = [(m.log_time_ns, m.data) for m in BagReader(out).messages([TOPIC])]
    numbers = np.array([int.from_bytes(data[16:24], "little") for _, data in found])
    shutil.rmtree(out)
    named = [(when_ns, text) for when_ns, text in heard if "not writing" in text]
    figures: dict[str, float | None] = {
        "named_ms": max(named[0][0] - found[-1][0], 0) / NANO * 1e3 if named and found else None,
        "told": float(process.returncode == 1 and "No space left on device" in output),
        "readable": float(len(found)),
        "gaps": float(np.count_nonzero(np.diff(numbers) != 1)),
    }
    return Trial(seed, figures, named[0][1] if named else "")


def unwritable(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Runs that are to be put where they cannot be."""
    script = Path(os.environ.get("HRI_PROJECT_ROOT", ""), *LAUNCH)
    if not script.is_file():
        raise Skipped("there are no scripts here: this is no checkout of the project")
    for seed in seeds:
        folder = place.folder / str(seed)
        folder.mkdir()
        (folder / "file").write_text("mine")
        (folder / "full").mkdir()
        (folder / "full" / "notes.txt").write_text("mine")
        wanted = (folder / "file", folder / "full", Path("/proc/nowhere/run"))[seed % 3]
        option = ("--out", "--record")[seed // 3 % 2]
        arguments = [option, str(wanted)]
        if option == "--record":
            arguments += ["--out", str(folder / "run")]
        begin = time.monotonic()
        done = subprocess.run(
            [sys.executable, str(script), *arguments],
            capture_output=True,
            text=True,
            timeout=120,
            env={**os.environ, "COLUMNS": "200"},
            check=False,
        )
        seconds = time.monotonic() - begin
        said = (done.stdout + done.stderr).strip()
        left = sorted(path.name for path in folder.rglob("*"))
        figures: dict[str, float | None] = {
            "refused": float(done.returncode == 1 and option in said and str(wanted) in said),
            "lines": float(len(said.splitlines())),
            "left": float(left != ["file", "full", "notes.txt"]),
            "seconds": seconds,
        }
        yield Trial(seed, figures, said.splitlines()[0] if said else "")
        shutil.rmtree(folder)


def rate(seeds: Sequence[int], place: Place) -> Iterator[Trial]:
    """Numbered messages from another process, and which of them are in the bag."""
    for seed in seeds:
        try:
            found = benchmark_recorder(RATE_HZ, SMOKE_SECONDS if place.smoke else SECONDS)
        except HriError as error:
            yield Trial(seed, {"lost": None}, str(error))
            continue
        figures: dict[str, float | None] = {
            "lost": float(found.lost),
            "gaps": float(found.gaps),
            "sent_hz": found.sent_rate_hz,
            "p99_ms": found.latency_p99_ms,
            "unsaved_s": found.longest_unsaved_s,
        }
        said = f"{found.recorded:,} of {found.sent:,} messages on {found.topics} topics recorded"
        yield Trial(seed, figures, said)


RECORDING = (
    Fault(
        "disk_full", "the disk gets full", "a recorder process on a tmpfs of 2 to 6 MB, filled by messages",
        "named on /diagnostics at once, and at its end; all that was written can be read, without a gap",
        PROCESSES,
        (
            Figure("named_ms", "named after the last message kept", "ms", 1000.0),
            Figure("told", "ends with exit code 1 and the reason", limit=1.0, least=True),
            Figure("readable", "messages readable", limit=1.0, least=True),
            Figure("gaps", "gaps between them", limit=0.0),
        ),
        full_disk,
    ),
    Fault(
        "unwritable_folder", "a folder that cannot be written",
        "--out or --record names a file, a folder that is not empty, or a place where nothing can be made",
        "one line that names option and folder, before anything starts; nothing is left behind", PROCESSES,
        (
            Figure("refused", "refused, and named", limit=1.0, least=True),
            Figure("lines", "lines that are said", limit=1.0),
            Figure("left", "anything left behind", limit=0.0),
            Figure("seconds", "after", "s", 20.0, digits=1),
        ),
        unwritable, count=24,
    ),
    Fault(
        "recorder_rate", "many messages", f"{RATE_HZ:,.0f} messages/s for {SECONDS:g} s (smoke: "
        f"{SMOKE_SECONDS:g} s), from another process",
        "every one is recorded", PROCESSES,
        (
            Figure("lost", "messages lost", limit=0.0),
            Figure("gaps", "gaps", limit=0.0),
            Figure("sent_hz", "sent", "/s", RATE_HZ * 0.98, least=True),
            Figure("p99_ms", "sending to receipt, p99", "ms", digits=1),
            Figure("unsaved_s", "longest unsaved", "s", 1.0, digits=2),
        ),
        rate, count=3,
    ),
)  # fmt: skip
"""Faults of recording."""
