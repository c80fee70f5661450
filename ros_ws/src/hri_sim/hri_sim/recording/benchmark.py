"""How many messages a second the recorder takes without loss, measured across processes.

One process publishes numbered messages at a steady rate on several topics; the recorder, in a
process of its own, records them; afterwards the numbers in the bag are compared with those sent,
topic by topic. Run it with ``scripts/benchmark_recorder.py --seconds 60``.
"""

from __future__ import annotations

import argparse
import array
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray

from hri_prediction.bags.inspect import inspect_bag
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import ConfigError, GraphError, HriError
from hri_prediction.results.origin import results_origin
from hri_sim.launch.folder import NewFolder
from hri_sim.recording.growth import FileGrowth, longest_unsaved_s

_TOPIC = "/benchmark/topic_{}"


@dataclass(frozen=True)
class BenchmarkResult:
    """Figures of one run.

    Attributes:
        rate_hz: Messages a second, as asked for, all topics together.
        topics: Topics.
        sent: Messages sent.
        sent_rate_hz: Rate that the publisher reached.
        recorded: Messages in the bag.
        lost: Numbers that are missing in the bag.
        gaps: How many times numbers are missing in a topic, one after another counting once.
        duplicated: Numbers that are there twice.
        recorder_cpu: CPU time of the recorder per second of publishing (1 = one core).
        recorder_rss_mb: Its memory at the end [MB].
        latency_p50_ms: Sending to receipt in the recorder.
        latency_p99_ms: Likewise.
        largest_lag_s: The longest from sending to receipt.
        longest_unsaved_s: The longest that a message which had been received was not in the file: what
            ``kill -9`` would have cost at the worst moment.
        file_bytes: Size of the bag's file.
    """

    rate_hz: float
    topics: int
    sent: int
    sent_rate_hz: float
    recorded: int
    lost: int
    gaps: int
    duplicated: int
    recorder_cpu: float
    recorder_rss_mb: float
    latency_p50_ms: float
    latency_p99_ms: float
    largest_lag_s: float
    longest_unsaved_s: float
    file_bytes: int


def _payload(number: int, size: int) -> bytes:
    """CDR of a ``std_msgs/UInt64MultiArray`` without layout: two numbers and padding."""
    count = max(1, size // 8)
    head = b"\x00\x01\x00\x00" + struct.pack("<III", 0, 0, count) + b"\x00" * 4
    return head + struct.pack("<Q", number) + b"\x00" * (8 * (count - 1))


def _number(data: bytes) -> int:
    return int(struct.unpack_from("<Q", data, 20)[0])


def publish(
    rate_hz: float, seconds: float, topics: int, size: int, reliable: bool, recorder: int
) -> dict[str, float]:
    """Publish numbered messages in turn on several topics; the body of the publisher process.

    Args:
        rate_hz: Messages a second, all topics together.
        seconds: How long.
        topics: Number of topics.
        size: Bytes of data in a message.
        reliable: Reliable publishers instead of best effort ones.
        recorder: Process number of the recorder, whose CPU time is measured meanwhile.
    """
    import rclpy
    from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
    from std_msgs.msg import UInt64MultiArray

    rclpy.init()
    node = rclpy.create_node("benchmark_publisher")
    profile = QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=1000,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
    )
    publishers = [
        node.create_publisher(UInt64MultiArray, _TOPIC.format(index), profile)
        for index in range(topics)
    ]
    end = time.monotonic() + 20.0
    while any(item.get_subscription_count() == 0 for item in publishers):
        if time.monotonic() > end:
            raise GraphError("the recorder did not subscribe within 20 s")
        time.sleep(0.05)
    time.sleep(0.5)
    total = round(rate_hz * seconds)
    process = psutil.Process(recorder)
    before = process.cpu_times()
    start = time.perf_counter()
    for number in range(total):
        ahead = start + number / rate_hz - time.perf_counter()
        if ahead > 0.0005:  # small bursts, as from a loaded machine
            time.sleep(ahead)
        publishers[number % topics].publish(_payload(number, size))
    elapsed = time.perf_counter() - start
    after = process.cpu_times()
    time.sleep(1.0)
    node.destroy_node()
    rclpy.try_shutdown()
    busy = after.user + after.system - before.user - before.system
    return {"sent": total, "rate": total / elapsed, "cpu": busy / elapsed}


def benchmark_recorder(
    rate_hz: float = 5000.0,
    seconds: float = 5.0,
    *,
    topics: int = 10,
    size: int = 64,
    reliable: bool = False,
    domain: int = 77,
    folder: str | Path | None = None,
) -> BenchmarkResult:
    """Measure one rate.

    Args:
        rate_hz: Messages a second, all topics together.
        seconds: How long to publish.
        topics: Number of topics.
        size: Size of the data in a message [bytes].
        reliable: Reliable publishers instead of best effort ones.
        domain: ROS domain of the two processes.
        folder: Where to put the bag; a temporary folder when not given.

    Raises:
        ConfigError: rate, duration, number or size is not above zero.
        GraphError: one of the processes failed.
    """
    if min(rate_hz, seconds, topics, size) <= 0:
        raise ConfigError(
            f"rate {rate_hz:g}, {seconds:g} s, {topics} topics of {size} bytes",
            expected="numbers above zero",
        )
    with tempfile.TemporaryDirectory() as scratch:
        bag = Path(folder or scratch) / "benchmark"
        env = {
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
        }
        recorder = subprocess.Popen(
            [
                *(sys.executable, "-m", "hri_sim.nodes.recorder_node", "--ros-args"),
                *("-p", f"output:={bag}", "-p", "min_free_megabytes:=1"),
            ],
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            code = (
                "import json; from hri_sim.recording.benchmark import publish; print(json.dumps("
                f"publish({rate_hz}, {seconds}, {topics}, {size}, {reliable}, {recorder.pid})))"
            )
            process = psutil.Process(recorder.pid)
            with FileGrowth(bag) as growth:
                publisher = subprocess.run(
                    [sys.executable, "-c", code],
                    env=env,
                    capture_output=True,
                    text=True,
                    timeout=seconds * 10 + 60,
                )
            if recorder.poll() is not None:
                raise GraphError(f"the recorder ended early: {recorder.communicate()[0].strip()}")
            if publisher.returncode:
                raise GraphError(f"the publisher failed: {publisher.stderr.strip()[-300:]}")
            sent = json.loads(publisher.stdout)
            memory = process.memory_info().rss
            recorder.send_signal(signal.SIGINT)
            if recorder.wait(timeout=30):
                raise GraphError(f"the recorder failed: {recorder.communicate()[0].strip()}")
        finally:
            if recorder.poll() is None:
                recorder.kill()
            recorder.communicate()
        counts = np.bincount(_numbers(bag, topics), minlength=int(sent["sent"]))
        reports = [t for t in inspect_bag(bag).topics if t.topic.startswith("/benchmark")]
        latencies = [topic.transport for topic in reports if topic.transport]
        (file,) = bag.glob("*.mcap")
        nan = float("nan")
        return BenchmarkResult(
            rate_hz=rate_hz,
            topics=topics,
            sent=int(sent["sent"]),
            sent_rate_hz=sent["rate"],
            recorded=int(counts.sum()),
            lost=int(np.count_nonzero(counts == 0)),
            gaps=sum(count_gaps(counts[topic::topics]) for topic in range(topics)),
            duplicated=int(np.sum(counts[counts > 1] - 1)),
            recorder_cpu=sent["cpu"],
            recorder_rss_mb=memory / 1e6,
            latency_p50_ms=max((item.p50 for item in latencies), default=nan) * 1e3,
            latency_p99_ms=max((item.p99 for item in latencies), default=nan) * 1e3,
            largest_lag_s=max((item.worst for item in latencies), default=nan),
            longest_unsaved_s=longest_unsaved_s(growth.seen, file),
            file_bytes=file.stat().st_size,
        )


def _numbers(bag: Path, topics: int) -> NDArray[np.int64]:
    """The numbers in a bag, in any order.

    Raises:
        GraphError: a message is not on the topic of its number.
    """
    names = {_TOPIC.format(index): index for index in range(topics)}
    found = array.array("q")
    for message in BagReader(bag).messages(names):
        number = _number(message.data)
        if number % topics != names[message.topic]:
            raise GraphError(f"message {number} was recorded on {message.topic}")
        found.append(number)
    return np.array(found, dtype=np.int64)


def count_gaps(counts: NDArray[np.int64]) -> int:
    """How many times numbers are missing, one after another counting once.

    Args:
        counts: How often each number of a topic was found, in the order of sending (N,).
    """
    missing = counts == 0
    return int(np.count_nonzero(missing[1:] & ~missing[:-1])) + int(missing[:1].any())


def main(argv: list[str] | None = None) -> int:
    """Measure one rate and print the figures as JSON; exit code 3 when messages were lost."""
    parser = argparse.ArgumentParser(
        prog="benchmark_recorder.py",
        description="Publish numbered messages at a steady rate, record them, and see whether every "
        "one is in the bag.",
        epilog="Exit codes: 0 nothing was lost, 3 something was, 1 it could not be measured.",
    )
    parser.add_argument("--rate", type=float, default=5000.0, help="messages a second")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to publish")
    parser.add_argument("--topics", type=int, default=10, help="number of topics")
    parser.add_argument("--size", type=int, default=64, help="bytes of data in a message")
    parser.add_argument("--reliable", action="store_true", help="reliable publishers")
    parser.add_argument("--smoke", action="store_true", help="for one second only")
    parser.add_argument(
        "--out", type=Path, help="folder for the figures, results.json, and the bag; new or empty"
    )
    options = parser.parse_args(argv)
    try:
        if options.out is not None:
            NewFolder(options.out, "--out")
        result = benchmark_recorder(
            options.rate,
            1.0 if options.smoke else options.seconds,
            topics=options.topics,
            size=options.size,
            reliable=options.reliable,
            folder=options.out,
        )
    except HriError as error:
        print(f"benchmark_recorder.py: {error}", file=sys.stderr)
        return 1
    figures = asdict(result)
    if options.out is not None:
        content = {**figures, "origin": results_origin()}
        (options.out / "results.json").write_text(json.dumps(content, indent=2) + "\n")
    print(json.dumps(figures, indent=2))
    return 3 if result.lost else 0


if __name__ == "__main__":
    sys.exit(main())
