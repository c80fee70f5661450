"""Recorder node: every topic of the graph, also those that appear later, to an MCAP bag."""

from __future__ import annotations

import functools
import gc
import json
import re
import signal
import sys
import time
from dataclasses import dataclass
from operator import itemgetter
from types import FrameType
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

import hri_prediction.ros.messages  # noqa: F401 - with another hri_msgs in front, half would be missed
from hri_prediction.bags.metadata import BagMetadata, TopicInfo
from hri_prediction.bags.schemas import message_class
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.ros.node import ERROR, OK, WARN, HriNode
from hri_prediction.ros.parameters import declare_config, refuse_undeclared
from hri_sim.nodes.recorded_topic import RecordedTopic, offered_qos
from hri_sim.recording.condition import Trouble, named, troubles
from hri_sim.recording.provenance import collect_provenance, custom_data, parse_provenance
from hri_sim.recording.recorder_core import RecorderConfig, RecorderCore, RecorderState

PERIOD_S = 0.1
"""How often the graph is looked at for new topics [s]."""
TAKE_S = 0.02
"""How often what has come is taken from the middleware [s], where it notes the time of receipt itself."""
_RECHECK_TICKS = 10
"""Known topics are checked for new publishers every so many looks."""
TROUBLES = "troubles"
"""Figure of its health that names the kinds of what is wrong: disk, queue, behind, types, transport."""
_DRAIN_S = 1.0
"""At the end: longest time to take what the middleware still holds [s]."""


@dataclass(frozen=True)
class RecorderNodeConfig:
    """What is recorded, and where to."""

    output: str = parameter("", "Bag folder to create; it must not exist. Required")
    exclude: str = parameter(
        "", "Regular expression; topics whose whole name matches are not recorded"
    )
    depth: int = parameter(
        5000,
        "Messages of one topic that the middleware keeps while the recorder is busy. Larger "
        "survives longer stalls and takes more memory",
        low=1000,
        high=100_000,
    )
    provenance: str = parameter(
        "", "What is known of the run (seed, parameters, models): a JSON object, or a file with one"
    )

    def __post_init__(self) -> None:
        validate(self)
        try:
            re.compile(self.exclude)
        except re.error as error:
            raise ConfigError(
                f"exclude = {self.exclude!r} is no regular expression: {error}"
            ) from error


class RecorderNode(HriNode):
    """Subscribes to all that is published, without deserialising, and hands it to the writer.

    With ``use_sim_time`` the log and publish times are those of ``/clock``; otherwise the times at
    which the middleware received and sent the message.

    Raises:
        ConfigError: no output given, the folder exists, a parameter is unknown or out of range.
        DataError: the disk is full.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("recorder", period_s=0.0, **kwargs)
        self._config = declare_config(self, RecorderNodeConfig)
        writing = declare_config(self, RecorderConfig)
        refuse_undeclared(self)  # before there is a bag
        if not self._config.output:
            raise ConfigError("parameter output is empty", expected="the bag folder to create")
        sim_time = bool(self.get_parameter("use_sim_time").value)
        self._log_time = self.now_ns if sim_time else None
        provenance = collect_provenance(parse_provenance(self._config.provenance))
        attachment = json.dumps(provenance, indent=2, sort_keys=True).encode()
        self.core = RecorderCore(
            self._config.output,
            writing,
            custom_data=custom_data(provenance),
            attachments=(("provenance.json", "application/json", attachment),),
        )
        self._exclude = re.compile(self._config.exclude) if self._config.exclude else None
        self._recorded: dict[str, RecordedTopic] = {}
        self._taken: list[tuple[int, RecordedTopic, bytes, dict[str, Any]]] = []
        self._ignored: set[str] = set()
        self._unknown: dict[str, str] = {}
        self._known_troubles: set[str] = set()
        self._ticks = 0
        self._last_state: tuple[float, RecorderState] | None = None
        self._look()
        # On its own clock: with use_sim_time, /clock itself must be found before it moves.
        self.set_period(PERIOD_S, Clock(clock_type=ClockType.STEADY_TIME))
        if self._log_time is None:
            self.create_timer(TAKE_S, self.take, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # ------------------------------------------------------------------ graph
    def on_tick(self, now_ns: int) -> None:
        """Look for new topics and publishers."""
        self._ticks += 1
        self._look()
        if self._ticks % _RECHECK_TICKS == 0:
            for name, recorded in list(self._recorded.items()):
                self._adapt(name, recorded, self.get_publishers_info_by_topic(name))
        for name, recorded in self._recorded.items():
            if recorded.gaps.suspects:
                recorded.gaps.settle(self.count_publishers(name))
        found = self._troubles()
        for trouble in found:
            self.fault(trouble.kind, trouble.text, ERROR if trouble.serious else WARN)
        kinds = {trouble.kind for trouble in found}
        if kinds - self._known_troubles:
            self._next_diagnostics_ns = now_ns  # at once
        self._known_troubles = kinds

    def _look(self) -> None:
        for name, types in self.get_topic_names_and_types():
            if name in self._recorded or name in self._ignored or name in self._unknown:
                continue
            if self._exclude is not None and self._exclude.fullmatch(name):
                self._ignored.add(name)
                continue
            publishers = self.get_publishers_info_by_topic(name)
            if not publishers:
                continue
            if len(types) > 1:
                self.fault(
                    name,
                    f"{name} is published with types {', '.join(types)}: "
                    f"only {publishers[0].topic_type} is recorded",
                )
            self._record(name, publishers)

    def _record(self, name: str, publishers: list[TopicEndpointInfo]) -> None:
        type_name = publishers[0].topic_type
        try:
            message_class(type_name)
        except DataError as error:
            self._unknown[name] = type_name
            self.fault(name, f"{name} is not recorded: {error}", ERROR)
            return
        info = TopicInfo(
            name,
            type_name,
            tuple(offered_qos(item.qos_profile) for item in publishers),
            str(publishers[0].topic_type_hash),
        )
        recorded = RecordedTopic(self.core, info, self._log_time, len(publishers))
        self._recorded[name] = recorded
        self._adapt(name, recorded, publishers)

    def _adapt(
        self, name: str, recorded: RecordedTopic, publishers: list[TopicEndpointInfo]
    ) -> None:
        """Subscribe so that all publishers match; again when a new one offers less."""
        if not publishers:
            return
        offered = [item.qos_profile for item in publishers]
        reliable = all(q.reliability == ReliabilityPolicy.RELIABLE for q in offered)
        latched = all(q.durability == DurabilityPolicy.TRANSIENT_LOCAL for q in offered)
        wanted = (
            ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        if recorded.qos is not None:
            # A subscription that asks for less than is offered stays: changing it would miss
            # messages and fetch latched ones twice.
            weaker = (
                recorded.qos[0] == ReliabilityPolicy.RELIABLE and not reliable,
                recorded.qos[1] == DurabilityPolicy.TRANSIENT_LOCAL and not latched,
            )
            if not any(weaker):
                return
            wanted = (
                wanted[0] if weaker[0] else recorded.qos[0],
                # No latched messages a second time.
                DurabilityPolicy.VOLATILE,
            )
            self.get_logger().info(f"{name}: a publisher that offers less; subscribing again")
        profile = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=self._config.depth,
            reliability=wanted[0],
            durability=wanted[1],
        )
        previous = recorded.subscription
        subscription = self.create_subscription(
            message_class(recorded.info.type), name, recorded.take, profile, raw=True
        )
        if self._log_time is None:
            self.poll(subscription, functools.partial(self._keep, recorded))
        # The events executor of Jazzy calls a callback with message info with one argument, which
        # rclpy's own check of signatures takes for a callback without: hence set by hand.
        subscription._callback_type = Subscription.CallbackType.WithMessageInfo
        recorded.subscription, recorded.qos = subscription, wanted
        if previous is not None:
            self.take()
            self.destroy_subscription(previous)

    def _keep(self, recorded: RecordedTopic, data: bytes, info: dict[str, Any]) -> None:
        self._taken.append((info["received_timestamp"], recorded, data, info))

    def take(self) -> None:
        """Take what has come, of all topics in the order of their receipt: that of an unclosed bag."""
        super().take()
        taken, self._taken = self._taken, []
        for _, recorded, data, info in sorted(taken, key=itemgetter(0)):
            recorded.take(data, info)

    # ------------------------------------------------------------------ health
    def _lost_in_transport(self) -> dict[str, int]:
        return {name: item.gaps.lost for name, item in self._recorded.items() if item.gaps.lost}

    def _troubles(self) -> list[Trouble]:
        core = self.core
        return troubles(core.state, core.dropped_by_topic, self._lost_in_transport(), self._unknown)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Rate, queue, size, drops; what is wrong, and which messages that costs."""
        state = self.core.state
        now = time.monotonic()
        rate = byte_rate = 0.0
        if self._last_state is not None:
            before, last = self._last_state
            rate = (state.received - last.received) / (now - before)
            byte_rate = (state.received_bytes - last.received_bytes) / (now - before)
        self._last_state = (now, state)
        lost = self._lost_in_transport()
        found = self._troubles()
        figures: dict[str, Any] = {
            "bag": str(self.core.folder),
            "topics": len(self._recorded),
            "messages": state.received,
            "messages_per_s": f"{rate:.1f}",
            "bytes_per_s": f"{byte_rate:.0f}",
            "written": state.written,
            "file_bytes": state.file_bytes,
            "queue": state.queued,
            "queue_bytes": state.queued_bytes,
            "queue_most": state.most_queued,
            "queue_share": f"{state.queue_share:.4f}",
            "behind_s": f"{state.behind_s:.2f}",
            "dropped": state.dropped,
            "lost_in_transport": sum(lost.values()),
            TROUBLES: " ".join(trouble.kind for trouble in found),
        }
        figures |= {f"received {name}": item.received for name, item in self._recorded.items()}
        figures |= {f"dropped {name}": n for name, n in self.core.dropped_by_topic.items()}
        figures |= {f"lost_in_transport {name}": n for name, n in lost.items()}
        figures |= {f"not recorded {name}": kind for name, kind in self._unknown.items()}
        if not found:
            return OK, "recording", figures
        level = ERROR if any(trouble.serious for trouble in found) else WARN
        return level, "; ".join(trouble.text for trouble in found), figures

    def close(self) -> None:
        """Write what is queued and close the bag; a second call does nothing.

        Raises:
            DataError: the disk did not take the end of the bag.
        """
        self.core.close()

    def finish(self) -> BagMetadata:
        """Close the bag and say what was recorded.

        Raises:
            DataError: the disk did not take all of it.
        """
        error = self.core.state.error
        try:
            metadata = self.core.close()
        except DataError as unclosed:
            # The disk does not even take the index: what is missing is what counts.
            self._refuse_losses(error or str(unclosed))
            raise
        text = f"{metadata.message_count} messages of {len(metadata.topics)} topics in "
        self.get_logger().info(f"{text}{self.core.folder}")
        self._refuse_losses(error)
        return metadata

    def _refuse_losses(self, error: str) -> None:
        state = self.core.state
        missing = state.dropped + state.lost
        if missing:
            topics = named(self.core.missing_by_topic)
            raise DataError(
                f"{missing} messages could not be written to {self.core.folder} ({topics})"
                + (f": {error}" if error else ""),
                hint="" if error else "what was written is readable",
            )


class _EndSignal:
    """Notes SIGINT and SIGTERM, leaving ROS alive so that what is under way can still be taken."""

    def __init__(self) -> None:
        self.seen = False
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.seen = True


def _drain(executor: Any, node: RecorderNode) -> None:
    """Take what the middleware still holds."""
    end = time.monotonic() + _DRAIN_S
    quiet = 0
    while quiet < 3 and time.monotonic() < end:
        before = node.core.state.received
        executor.spin_once(timeout_sec=0.01)
        node.take()
        quiet = 0 if node.core.state.received > before else quiet + 1


def main(args: list[str] | None = None) -> int:
    """Record until Ctrl-C or SIGTERM (or, by policy, until the disk is full)."""
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    stop = _EndSignal()
    node: RecorderNode | None = None
    executor = None
    code = 0
    try:
        node = RecorderNode()
        executor = EventsExecutor()
        executor.add_node(node)
        gc.collect()
        gc.freeze()
        node.take_precedence()
        print(f"{node.get_name()} ready: records all topics to {node.core.folder}", flush=True)
        while rclpy.ok() and not stop.seen and not node.core.must_end:
            executor.spin_once(timeout_sec=0.1)
        if node.core.must_end:
            node.tick()  # says so, on /diagnostics too
        else:
            _drain(executor, node)
        node.finish()
    except HriError as error:
        print(f"recorder: {error}", file=sys.stderr, flush=True)
        code = 1
    finally:
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return code


if __name__ == "__main__":
    sys.exit(main())
