"""Print the messages of a topic, or how often they come."""

from __future__ import annotations

import argparse
import csv
import difflib
import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import install_signal_handlers, uninstall_signal_handlers

from hri_prediction.bags.schemas import message_class
from hri_prediction.errors import GraphError, HriError
from hri_sim.tools.fields import columns, follow, parse_field, to_text

_PATIENCE_S = 1.0
"""A topic that is not there after this time is announced as missing [s]."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="echo_topic.py",
        description="Print the messages of a topic. Type and QoS are those of its publishers.",
    )
    parser.add_argument("topic", help="topic name, such as /joint_states")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--hz", action="store_true", help="print rates once a second instead")
    kind.add_argument("--csv", action="store_true", help="print one row a message")
    count = parser.add_mutually_exclusive_group()
    count.add_argument("--once", action="store_true", help="end after the first message")
    count.add_argument("--count", type=int, default=0, metavar="N", help="end after N messages")
    parser.add_argument("--field", metavar="PATH", help="only this part, such as position[0]")
    parser.add_argument(
        "--timeout", type=float, default=0.0, metavar="S", help="end after S s without a message"
    )
    return parser


class _Printer:
    """What is done with each message; counts them."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._steps = parse_field(options.field) if options.field else []
        self._label = options.field or ""
        self._csv = csv.writer(sys.stdout, lineterminator="\n") if options.csv else None
        self._header: list[str] = []
        self.count = 0

    def show(self, message: Any) -> None:
        self.count += 1
        value = follow(message, self._steps) if self._steps else message
        if self._csv is None:
            print(to_text(value) if self._steps else f"{to_text(value)}\n---", flush=True)
            return
        row = columns(value, self._label)
        if list(row) != self._header:
            self._header = list(row)
            self._csv.writerow(["received_s", *self._header])
        self._csv.writerow([f"{time.time():.6f}", *row.values()])
        sys.stdout.flush()


class _Rate:
    """Rates over the last seconds."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=20_000)
        self._next = 0.0
        self.count = 0

    def show(self, data: bytes) -> None:
        """Note one message; once a second, print."""
        now = time.perf_counter()
        self.count += 1
        self._times.append(now)
        if self._next == 0.0:
            self._next = now + 1.0
        if now >= self._next and len(self._times) > 1:
            self._next = now + 1.0
            steps = np.diff(self._times)
            print(
                f"{1.0 / steps.mean():.2f} Hz  period min {steps.min() * 1e3:.3f} "
                f"max {steps.max() * 1e3:.3f} sd {steps.std() * 1e3:.3f} ms  "
                f"{len(self._times)} messages",
                flush=True,
            )
            while self._times and self._times[0] < now - 5.0:
                self._times.popleft()


def near_names(topic: str, known: list[str]) -> list[str]:
    """Names that someone who wrote ``topic`` may have meant, best first."""
    last = topic.rsplit("/", 1)[-1]
    close = difflib.get_close_matches(topic, known, n=5, cutoff=0.6)
    return list(dict.fromkeys([*close, *[name for name in known if last and last in name]]))[:8]


def _wait_for(
    node: Node, topic: str, spin: Callable[[], None], timeout_s: float
) -> tuple[str, QoSProfile]:
    """Type and QoS of a topic, as soon as it is published."""
    start = time.monotonic()
    told = False
    while rclpy.ok(context=node.context):
        publishers = node.get_publishers_info_by_topic(topic)
        if publishers:
            offered = [item.qos_profile for item in publishers]
            reliable = all(q.reliability == ReliabilityPolicy.RELIABLE for q in offered)
            latched = all(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in offered)
            return publishers[0].topic_type, QoSProfile(
                history=HistoryPolicy.KEEP_LAST,
                depth=1000,
                reliability=ReliabilityPolicy.RELIABLE
                if reliable
                else ReliabilityPolicy.BEST_EFFORT,
                durability=DurabilityPolicy.TRANSIENT_LOCAL
                if latched
                else DurabilityPolicy.VOLATILE,
            )
        waited = time.monotonic() - start
        names = [name for name, _ in node.get_topic_names_and_types() if name != topic]
        near = near_names(topic, names)
        there = "there are " + ", ".join(near) if near else f"{len(names)} other topics are there"
        if timeout_s and waited > timeout_s:
            raise GraphError(f"nobody publishes {topic} after {waited:.1f} s", hint=there)
        if not told and waited > _PATIENCE_S:
            told = True
            print(f"waiting for {topic}: nobody publishes it yet; {there}", file=sys.stderr)
        spin()
    raise ExternalShutdownException


def _echo(options: argparse.Namespace, node: Node) -> None:
    executor = EventsExecutor(context=node.context)
    executor.add_node(node)

    def spin() -> None:
        executor.spin_once(timeout_sec=0.05)

    try:
        topic = node.resolve_topic_name(options.topic)
        kind, qos = _wait_for(node, topic, spin, options.timeout)
        sink: _Printer | _Rate = _Rate() if options.hz else _Printer(options)
        wanted = 1 if options.once else options.count
        inbox: deque[Any] = deque()

        def take(message: Any) -> None:  # rclpy wants a function with a signature
            inbox.append(message)

        node.create_subscription(message_class(kind), topic, take, qos, raw=options.hz)
        last = time.monotonic()
        while rclpy.ok(context=node.context):
            spin()
            if inbox:
                last = time.monotonic()
            while inbox:
                sink.show(inbox.popleft())
                if wanted and sink.count >= wanted:
                    return
            if options.timeout and time.monotonic() - last > options.timeout:
                raise GraphError(
                    f"no message on {topic} for {options.timeout:g} s",
                    hint=f"it is published by {node.count_publishers(topic)} nodes",
                )
    finally:
        executor.shutdown()


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _parser().parse_args(argv)
    context = rclpy.Context()
    rclpy.init(context=context, args=[])
    install_signal_handlers()
    node = rclpy.create_node("echo_topic", context=context, enable_rosout=False)
    try:
        _echo(options, node)
    except (KeyboardInterrupt, ExternalShutdownException, BrokenPipeError):
        pass
    except HriError as error:
        print(f"echo_topic.py: {error}", file=sys.stderr)
        return 1
    finally:
        node.destroy_node()
        rclpy.try_shutdown(context=context)
        uninstall_signal_handlers()
    return 0


if __name__ == "__main__":
    sys.exit(main())
