"""Nodes of this machine are seen on this machine, in their own domain, and nowhere else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator

import pytest

from hri_prediction.ros.this_machine import stay_on_this_machine
from hri_sim.testing.domain import own_domain

DOMAIN = own_domain("isolation")
PRESENT = """
import rclpy, sys
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("present")
publisher = node.create_publisher(String, "said", 1)
node.create_timer(0.1, lambda: publisher.publish(String(data="here")))
print("ready", flush=True)
rclpy.spin(node)
"""
LOOK = """
import rclpy, time
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("looking")
heard = []
node.create_subscription(String, "said", heard.append, 1)
end = time.monotonic() + 4.0
while time.monotonic() < end and not (heard and "present" in node.get_node_names()):
    rclpy.spin_once(node, timeout_sec=0.1)
print("SEES", *sorted(set(node.get_node_names()) - {"looking"}), "HEARS", len(heard) > 0)
"""


def environment(domain: int) -> dict[str, str]:
    chosen = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "FAST"))}
    return {**chosen, **stay_on_this_machine(chosen), "ROS_DOMAIN_ID": str(domain)}


@pytest.fixture(scope="module", autouse=True)
def present() -> Iterator[None]:
    """A node that publishes."""
    with subprocess.Popen(
        [sys.executable, "-c", PRESENT],
        env=environment(DOMAIN),
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == "ready"
        yield
        process.kill()


def look(domain: int, *before: str) -> str:
    done = subprocess.run(
        [*before, sys.executable, "-c", LOOK],
        env=environment(domain),
        capture_output=True,
        text=True,
        timeout=60.0,
        check=True,
    )
    return done.stdout.strip()


def test_the_same_domain_sees_it() -> None:
    assert look(DOMAIN) == "SEES present HEARS True"


def test_another_domain_sees_nothing() -> None:
    assert look(DOMAIN + 1) == "SEES HEARS False"


def test_another_machine_sees_nothing() -> None:
    """Another network namespace: it has a loopback interface of its own, as another machine has."""
    unshare = shutil.which("unshare")
    if unshare is None:
        pytest.skip("there is no unshare here")
    inside = "import fcntl, os, socket, struct, sys\n" + (
        "s = socket.socket()\n"
        "fcntl.ioctl(s, 0x8914, struct.pack('16sH14s', b'lo', 0x49, b''))\n"  # SIOCSIFFLAGS: up
        "os.execv(sys.argv[1], sys.argv[1:])\n"
    )
    apart = [unshare, "--net", sys.executable, "-c", inside]
    if subprocess.run([*apart, "/bin/true"], capture_output=True).returncode:
        pytest.skip("no network namespace may be made here")
    assert look(DOMAIN, *apart) == "SEES HEARS False"
