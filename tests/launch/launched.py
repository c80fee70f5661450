"""A launch script that runs in a process of its own."""

from __future__ import annotations

import contextlib
import csv
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil
import rclpy
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState

from hri_prediction.ros.qos import SENSOR
from hri_sim.launch.folder import LOGS

NODES = (
    "simulator", "person", "predictor", "ptomp", "policy", "recorder", "adaptation", "observer",
    "separation_monitor",
)  # fmt: skip


@dataclass
class Launched:
    """A launch script that runs, and what it prints."""

    process: subprocess.Popen[str]
    out: Path
    printed: Path
    domain: int

    @property
    def text(self) -> str:
        """All that it has printed so far."""
        return self.printed.read_text()

    def nodes(self) -> dict[str, psutil.Process]:
        """Its node processes, by name."""
        found = {}
        with contextlib.suppress(psutil.NoSuchProcess):
            for child in psutil.Process(self.process.pid).children(recursive=True):
                words = child.cmdline()
                for name in NODES:
                    if any(word.endswith(f"/{name}") for word in words):
                        found[name] = child
        return found

    def wait_for(self, word: str, timeout_s: float = 40.0) -> None:
        """Until it has printed a word."""
        self.wait_until(lambda: word in self.text, timeout_s)

    def wait_for_trials(self, count: int, timeout_s: float = 120.0) -> None:
        """Until so many trials of an experiment are done."""
        self.wait_until(lambda: len(self.trials()) >= count, timeout_s)

    def trials(self) -> list[dict[str, str]]:
        """Trials of an experiment, as its table has them."""
        try:
            with (self.out / "trials" / "trials.csv").open() as file:
                return list(csv.DictReader(file))
        except FileNotFoundError:
            return []

    def wait_until(self, done: Callable[[], bool], timeout_s: float = 40.0) -> None:
        """Until something is so while it runs."""
        end = time.monotonic() + timeout_s
        while not done():
            assert self.process.poll() is None, self.text
            assert time.monotonic() < end, f"{self.text}\n{self.logged()}"
            time.sleep(0.02)

    def logged(self, lines: int = 8) -> str:
        """What each of its nodes has said last."""
        logs = sorted(self.out.rglob(f"{LOGS}/*.log"))
        return "\n".join(
            "\n".join((f"--- {log.stem}", *log.read_text().splitlines()[-lines:])) for log in logs
        )

    def end(self, timeout_s: float = 60.0) -> int:
        """Exit code, once it has ended."""
        return self.process.wait(timeout_s)


def addresses(node: psutil.Process) -> set[str]:
    """Where a process listens; the system's table is looked at again while the process is not in it."""
    for _ in range(20):
        found = {c.laddr.ip for c in node.net_connections("inet")}
        if found:
            break
        time.sleep(0.1)
    return found


def dropped(node: psutil.Process) -> int:
    """Datagrams that the system had for a process and threw away, because its sockets were full."""
    ports = {c.laddr.port for c in node.net_connections("udp4")}
    table = Path("/proc/net/udp").read_text().splitlines()[1:]
    rows = [line.split() for line in table]
    return sum(int(row[-1]) for row in rows if int(row[1].partition(":")[2], 16) in ports)


def wait_until_moving(launched: Launched, speed: float = 0.3, timeout_s: float = 60.0) -> None:
    """Until a joint is faster than this [rad/s], heard on the graph itself."""
    context = Context()
    rclpy.init(context=context, domain_id=launched.domain)
    node = Node("watcher", context=context)
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    seen: list[float] = [0.0]
    node.create_subscription(
        JointState, "/joint_states", lambda m: seen.append(max(map(abs, m.velocity))), SENSOR
    )
    end = time.monotonic() + timeout_s
    try:
        while max(seen) < speed:
            executor.spin_once(timeout_sec=0.05)
            assert launched.process.poll() is None, launched.text
            assert time.monotonic() < end, launched.text
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
