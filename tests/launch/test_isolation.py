"""Nodes of this machine are seen on this machine, in their own domain, and nowhere else."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from types import MappingProxyType

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


def environment(domain: int, choice: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """Of a program of this project, where a user has chosen something of discovery, or nothing."""
    others = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "FAST"))}
    chosen = {**others, **choice}
    return {**chosen, **stay_on_this_machine(chosen), "ROS_DOMAIN_ID": str(domain)}


@contextlib.contextmanager
def present_in(chosen: dict[str, str], *before: str) -> Iterator[None]:
    """A node that publishes."""
    with subprocess.Popen(
        [*before, sys.executable, "-c", PRESENT], env=chosen, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == "ready"
        try:
            yield
        finally:
            process.kill()


@pytest.fixture(scope="module", autouse=True)
def present() -> Iterator[None]:
    """A node of this machine."""
    with present_in(environment(DOMAIN)):
        yield


def look(domain: int, *before: str, choice: Mapping[str, str] = MappingProxyType({})) -> str:
    """What somebody sees and hears, who is started by a command, with a choice of discovery."""
    done = subprocess.run(
        [*before, sys.executable, "-c", LOOK],
        env=environment(domain, choice),
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


INSIDE = """
import fcntl, socket, struct, subprocess, sys
said = socket.socket()
fcntl.ioctl(said, 0x8914, struct.pack("16sH14s", b"lo", 0x49, b""))  # SIOCSIFFLAGS: up
present = sys.argv[1]
with subprocess.Popen([sys.executable, "-c", present], stdout=subprocess.PIPE) as process:
    if present:
        process.stdout.readline()
    code = subprocess.run(sys.argv[2:]).returncode
    process.kill()
sys.exit(code)
"""
"""Runs a command in a network namespace, with another program beside it; none: an empty text."""


def namespace(present: str = "") -> tuple[str, ...]:
    """What runs a command in a network namespace of its own, as another machine has a loopback of its own.

    Args:
        present: Program that runs beside the command, in the same namespace.
    """
    unshare = shutil.which("unshare")
    if unshare is None:
        pytest.skip("there is no unshare here")
    apart = (unshare, "--net", sys.executable, "-c", INSIDE)
    if subprocess.run([*apart, "", "/bin/true"], capture_output=True).returncode:
        pytest.skip("no network namespace may be made here")
    return (*apart, present)


def test_another_machine_sees_nothing() -> None:
    """And whoever looks there does see what runs beside them: it is not that nothing could be seen."""
    assert look(DOMAIN, *namespace()) == "SEES HEARS False"
    assert look(DOMAIN, *namespace(PRESENT)) == "SEES present HEARS True"


@contextlib.contextmanager
def cable() -> Iterator[tuple[list[str], list[str]]]:
    """Two network namespaces with a cable between them; what runs commands in each."""
    tools = [shutil.which(name) for name in ("unshare", "nsenter", "ip")]
    if not all(tools):
        pytest.skip("there is no unshare, nsenter or ip here")
    unshare, nsenter, ip = map(str, tools)
    with contextlib.ExitStack() as stack:
        ends = []
        for _ in range(2):
            # The shell says that it is in its namespace, and stays there until its input ends.
            process = subprocess.Popen(
                [unshare, "--net", "sh", "-c", "echo; read _"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
            )
            stack.enter_context(process)
            assert process.stdout is not None
            process.stdout.readline()
            ends.append(process.pid)
        one, other = ([nsenter, "--target", str(pid), "--net"] for pid in ends)
        steps = [[*one, ip, "link", "add", "end", "type", "veth", "peer", "end", "netns", ends[1]]]
        for number, enter in enumerate((one, other), 1):
            steps += [
                [*enter, ip, "link", "set", "lo", "up"],
                [*enter, ip, "address", "add", f"10.76.0.{number}/24", "dev", "end"],
                [*enter, ip, "link", "set", "end", "up"],
                [*enter, ip, "route", "add", "default", "dev", "end"],
            ]
        for step in steps:
            if subprocess.run(list(map(str, step)), capture_output=True).returncode:
                pytest.skip("no network namespaces may be linked here")
        yield one, other


@pytest.mark.parametrize(
    ("choice", "sees"),
    [
        ({}, "SEES HEARS False"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "SEES present HEARS True"),
    ],
    ids=["as it is", "opened"],
)
def test_a_machine_on_the_same_cable(choice: dict[str, str], sees: str) -> None:
    """Whoever looks with discovery of the whole subnet sees only what was opened to it."""
    opened = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
    with cable() as (one, other), present_in(environment(DOMAIN, choice), *one):
        assert look(DOMAIN, *other, choice=opened) == sees
