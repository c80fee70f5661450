"""Print the messages of a topic, or how often they come."""

from __future__ import annotations

import argparse
import csv
import difflib
import os
import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import install_signal_handlers, uninstall_signal_handlers

from hri_prediction.bags.schemas import message_class
from hri_prediction.errors import GraphError, HriError
from hri_sim.tools.fields import columns, follow, parse_field, to_text

_DISCOVERY_S = 3.5
"""A topic unknown for this long is called missing [s]; nodes announce themselves every 3 s."""
_QUIET_S = 2.0
"""A topic that is there, but without a message for this long, is called quiet [s]."""
_EVERYWHERE = ("/rosout", "/parameter_events")
"""Topics that say nothing about which graph is there: every node has them."""
_MOST_NAMES = 8


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
        "--only", metavar="PATH=VALUE", help="only messages in which this is so, such as state=2"
    )
    parser.add_argument(
        "--timeout", type=float, default=0.0, metavar="S", help="end after S s without a message"
    )
    return parser


class _Printer:
    """What is done with each message; counts them."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._steps = parse_field(options.field) if options.field else []
        self._label = options.field or ""
        path, _, wanted = str(options.only or "").partition("=")
        self._wanted, self._only = wanted, parse_field(path) if path else []
        self._csv = csv.writer(sys.stdout, lineterminator="\n") if options.csv else None
        self._header: list[str] = []
        self.count = 0
        self.others = 0
        """Messages that were not asked for."""
        self.last_other = ""
        """What was in the latest of these instead."""

    def show(self, message: Any) -> None:
        if self._only:
            found = to_text(follow(message, self._only), "").strip()
            # The names of a message's constants, as messages are documented with.
            named = getattr(type(message), self._wanted, None) if self._wanted.isupper() else None
            if found not in (self._wanted, str(named)):
                self.others += 1
                self.last_other = found
                return
        self.count += 1
        value = follow(message, self._steps) if self._steps else message
        if self._csv is None:
            text = to_text(value, self._label)
            print(text if self._steps else f"{text}\n---", flush=True)
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


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = _parser()
    options = parser.parse_args(argv)
    if options.hz and (options.once or options.count == 1):
        parser.error("--hz needs two messages at least: leave --once away, or say --count N")
    if options.hz and options.field:
        parser.error("--hz counts whole messages: leave --field away")
    if options.only and not all(options.only.partition("=")):
        parser.error(f"--only {options.only}: expected PATH=VALUE, such as state=2")
    if options.hz and options.only:
        parser.error("--hz counts all messages: leave --only away")
    if options.count < 0:
        parser.error(f"--count {options.count}: expected a positive number")
    if not 0.0 <= options.timeout < float("inf"):
        parser.error(f"--timeout {options.timeout:g}: expected a number of seconds, 0 for none")
    return options


def near_names(topic: str, known: list[str]) -> list[str]:
    """Names that someone who wrote ``topic`` may have meant, best first."""
    last = topic.rsplit("/", 1)[-1]
    close = difflib.get_close_matches(topic, known, n=5, cutoff=0.6)
    return list(dict.fromkeys([*close, *[name for name in known if last and last in name]]))[
        :_MOST_NAMES
    ]


def what_there_is(topic: str, known: list[str]) -> str:
    """In words, for somebody who waits for ``topic``: similar names, else those that there are."""
    others = sorted(name for name in known if name != topic and name not in _EVERYWHERE)
    if not others:
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        return f"no graph is running in ROS domain {domain}"
    near = near_names(topic, others)
    if near:
        return f"did you mean {' or '.join(near)}?"
    more = len(others) - _MOST_NAMES
    listed = ", ".join(others[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
    return f"there {'is' if len(others) == 1 else 'are'} {listed}"


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
        there = what_there_is(topic, [name for name, _ in node.get_topic_names_and_types()])
        if timeout_s and waited > timeout_s:
            raise GraphError(f"nobody publishes {topic} after {waited:.1f} s", hint=there)
        if not told and waited > _DISCOVERY_S:
            told = True
            print(f"waiting for {topic}: nobody publishes it yet; {there}", file=sys.stderr)
        spin()
    raise ExternalShutdownException


def _publishers(node: Node, topic: str) -> str:
    names = sorted({item.node_name for item in node.get_publishers_info_by_topic(topic)})
    return f"its publisher is {', '.join(names)}" if names else "its publisher has gone"


def _others(sink: _Printer | _Rate, options: argparse.Namespace) -> str:
    """How many came that were not asked for, and what was in the latest."""
    if not isinstance(sink, _Printer) or not sink.others:
        return ""
    path = options.only.partition("=")[0]
    return f" with {options.only} ({sink.others} others, the latest with {path}={sink.last_other})"


def _echo(options: argparse.Namespace, node: Node) -> None:
    executor = EventsExecutor(context=node.context)
    executor.add_node(node)

    def spin() -> None:
        executor.spin_once(timeout_sec=0.05)

    try:
        try:
            topic = node.resolve_topic_name(options.topic)
        except (InvalidTopicNameException, ValueError, RuntimeError) as error:
            raise GraphError(
                f"topic {options.topic!r}: no valid name",
                expected="letters, digits, _ and /, as in /humans/bodies/tracked",
            ) from error
        kind, qos = _wait_for(node, topic, spin, options.timeout)
        sink: _Printer | _Rate = _Rate() if options.hz else _Printer(options)
        wanted = 1 if options.once else options.count
        inbox: deque[Any] = deque()

        def take(message: Any) -> None:  # rclpy wants a function with a signature
            inbox.append(message)

        node.create_subscription(message_class(kind), topic, take, qos, raw=options.hz)
        start = last = time.monotonic()
        told = False
        while rclpy.ok(context=node.context):
            spin()
            while inbox:
                before = sink.count
                sink.show(inbox.popleft())
                if sink.count > before:
                    last = time.monotonic()
                if wanted and sink.count >= wanted:
                    return
            now = time.monotonic()
            if options.timeout and now - last > options.timeout:
                raise GraphError(
                    f"no message on {topic} for {options.timeout:g} s{_others(sink, options)}",
                    hint=_publishers(node, topic),
                )
            if not told and sink.count == 0 and now - start > _QUIET_S:
                told = True
                print(
                    f"waiting for {topic}: no message yet{_others(sink, options)}; "
                    f"{_publishers(node, topic)}",
                    file=sys.stderr,
                )
    finally:
        executor.shutdown()


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _options(argv)
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
