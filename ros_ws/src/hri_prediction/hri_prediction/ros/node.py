"""Base class of all nodes: messages wait, a tick takes them and computes.

The same node runs in three ways. In real time a timer on the node's clock drives its tick; with
``use_sim_time`` that clock is ``/clock``; in lock-step a coordinator calls :meth:`HriNode.tick` with the
time, and nothing moves in between. In all three a tick sees its messages ordered by (stamp, topic),
whatever the order of their arrival.
"""

from __future__ import annotations

import copy
import faulthandler
import gc
import inspect
import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription

from hri_prediction.compiled import compiled_variants
from hri_prediction.errors import HriError
from hri_prediction.flow import Flow
from hri_prediction.ros.diagnostics import ERROR, OK, WARN, Diagnostics
from hri_prediction.ros.end_signal import EndSignal
from hri_prediction.ros.inbox import Handler, Inbox
from hri_prediction.ros.parameters import declare_config, refuse_undeclared
from hri_prediction.ros.polling import PollingNode
from hri_prediction.ros.qos import LATCHED
from hri_prediction.ros.readiness import ready_line
from hri_prediction.ros.scheduling import SHARED, SchedulingConfig, take_precedence
from hri_prediction.ros.time import NANO, to_ns

STANDSTILL = "was not run for"
"""What a node's health says of a machine that did not run it."""
STANDSTILL_S = 0.25
"""Ticks that come later than this after the one before are spoken of [s]."""
STARTING_NS = 10 * NANO
"""For so long after its first tick a node speaks more often: who starts a graph waits for that [ns]."""
STARTING_PERIOD_NS = NANO // 5
NEWS_PERIOD_NS = NANO // 10  # a new fault is told so long after what was told last, at least [ns]
"""How often it does so then [ns]."""
COUNTED_DROPS = 50
"""So many messages that newer ones push out between two ticks are counted; of more, the rest is not."""
TEARDOWN_S = 3.0
"""So long may the middleware take to let go of a node that ends [s]."""


class CountedPublisher:
    """A publisher that counts what it sends, so that a coordinator knows what must arrive."""

    def __init__(self, publisher: Publisher, message_type: Any, qos: QoSProfile) -> None:
        self.publisher = publisher
        self.message_type = message_type
        self.qos = qos
        self.topic: str = publisher.topic_name
        self.sent = 0

    @property
    def subscription_count(self) -> int:
        """Number of subscriptions that the middleware has matched."""
        return int(self.publisher.get_subscription_count())

    def publish(self, message: Any) -> None:
        """Publish one message, or the bytes of one."""
        self.sent += 1
        self.publisher.publish(message)


class HriNode(PollingNode):
    """A node whose messages wait in the middleware until its tick takes them and computes.

    Args:
        name: Node name.
        period_s: Period of the tick [s]; 0 when :meth:`set_period` follows.
        lockstep_ns: Time before the first tick [ns], in lock-step: no timer and no own clock, a
            coordinator calls :meth:`tick`. None: the node's own clock and timer.
        context: rclpy context; the default one when not given.
        kwargs: For :class:`rclpy.node.Node` (``namespace``, ``parameter_overrides``, …).
    """

    def __init__(
        self,
        name: str,
        *,
        period_s: float,
        lockstep_ns: int | None = None,
        context: Context | None = None,
        **kwargs: Any,
    ) -> None:
        super().__init__(name, context=context, **kwargs)
        self._realtime_priority = declare_config(self, SchedulingConfig).realtime_priority
        self.scheduling = SHARED
        self.lockstep = lockstep_ns is not None
        self.period_s = period_s
        self.tick_ns = lockstep_ns or 0  # when the present tick began: for its handlers
        self.received: dict[str, int] = {}
        self.publishers_by_topic: dict[str, CountedPublisher] = {}
        self._inbox = Inbox()
        self._subscribed: dict[str, Subscription] = {}
        # For the coordinator of lock-step: topics may come and go, and what was said on them counts.
        self.topic_changes = 0
        self.withdrawn: dict[str, int] = {}
        self._lockstep_now_ns = lockstep_ns or 0
        # Added to the wall clock for the node's time at a receipt, which the middleware says.
        self._ahead_ns = 0
        self._worked_s = self._asked_s = 0.0
        # Compiled kernels at the first tick: none may be added afterwards.
        self._variants: dict[str, int] | None = None
        self._next_diagnostics_ns = self._diagnosed_ns = 0
        self.started_ns = 0
        self._diagnostics = Diagnostics(self, self._inbox.dropped)
        self._timer: Any = None
        self.ticks_on_own_clock = True
        if period_s > 0:
            self.set_period(period_s)

    def set_period(self, period_s: float, clock: Clock | None = None) -> None:
        """Set the period of the tick [s], for nodes whose period is a parameter.

        Args:
            period_s: The period [s].
            clock: Clock of the timer. When not given, ``/clock`` with ``use_sim_time``, else a steady one:
                by the time of the day it would wait for an hour when that is set back by one.
        """
        self.period_s = period_s
        self.ticks_on_own_clock = clock is None
        if self._timer is not None:
            self.destroy_timer(self._timer)
        if not self.lockstep:
            if clock is None and not self.get_parameter("use_sim_time").value:
                clock = Clock(clock_type=ClockType.STEADY_TIME)
            self._timer = self.create_timer(period_s, self.tick, clock=clock)

    # ---------------------------------------------------------------- time
    def now_ns(self) -> int:
        """The node's time: the coordinator's in lock-step, else the ROS clock's."""
        if self.lockstep:
            return self._lockstep_now_ns
        if not self._time_source.ros_time_is_active:
            return time.time_ns()  # which a ROS clock then gives, with ten times the work
        return int(self.get_clock().now().nanoseconds)

    def _receipt_ns(self, wall_ns: int) -> int:
        """The node's time at a time of the wall clock, which has counted it since the last tick [ns]."""
        return self._lockstep_now_ns if self.lockstep else wall_ns + self._ahead_ns

    # ---------------------------------------------------------------- topics
    def announce(self, message_type: Any, topic: str, qos: QoSProfile) -> CountedPublisher:
        """Create a publisher whose messages are counted."""
        publisher = self.create_publisher(message_type, topic, qos)
        counted = CountedPublisher(publisher, message_type, qos)
        self.publishers_by_topic[counted.topic] = counted
        self.topic_changes += 1
        return counted

    def withdraw(self, publisher: CountedPublisher) -> None:
        """Destroy a publisher of :meth:`announce`."""
        del self.publishers_by_topic[publisher.topic]
        if self.lockstep:
            sent = self.withdrawn.get(publisher.topic, 0) + publisher.sent
            self.withdrawn[publisher.topic] = sent
        self.topic_changes += 1
        self.destroy_publisher(publisher.publisher)

    def listen(
        self,
        message_type: Any,
        topic: str,
        handler: Callable[..., None],
        qos: QoSProfile,
        *,
        command: bool = False,
        timed: bool = False,
    ) -> None:
        """Subscribe; ``handler`` is called on the next tick, not on arrival.

        The order on the tick is by (stamp in the header, topic); messages without a header count as
        stamped at the tick, and so do commands, whose stamp says when they are to take effect: a later
        command takes the place of an earlier one. Of more messages than the depth of ``qos`` between two
        ticks the oldest are dropped, and counted on /diagnostics. With ``timed`` the handler also takes
        when the middleware received it [ns]: by the node's time, reckoned back from the tick as if that
        went as fast as the wall clock; in lock-step the time of the tick before.
        """
        resolved = self.resolve_topic_name(topic)
        self.received[resolved] = 0
        take: Handler = (lambda told: handler(*told)) if timed else handler
        keep = self._inbox.open(resolved, qos.depth, take)
        stamped = not command and "header" in message_type.get_fields_and_field_types()
        flow = Flow(delays=stamped and qos.durability != LATCHED.durability)
        self._diagnostics.listened(resolved, flow, qos.reliability)
        note, receipt_ns, received = flow.note, self._receipt_ns, self.received

        def store(message: Any, info: dict[str, Any] | None = None) -> None:
            stamp_ns = to_ns(message.header.stamp) if stamped else 0
            wall_ns = info["received_timestamp"] if info else 0
            came_ns = receipt_ns(wall_ns or time.time_ns())
            told = (message, came_ns) if timed else message
            if keep(stamp_ns if stamped else sys.maxsize, told):
                received[resolved] += 1
                note(came_ns, stamp_ns)

        if not self.lockstep:
            qos = copy.copy(qos)
            qos.depth += COUNTED_DROPS
        subscription = self.create_subscription(message_type, topic, store, qos)
        if not self.lockstep:
            self.poll(subscription, store)
        self._subscribed[resolved] = subscription
        self.topic_changes += 1

    def ignore(self, topic: str) -> None:
        """End the subscription to a topic; what it has brought and is not handed over yet is dropped."""
        resolved = self.resolve_topic_name(topic)
        del self.received[resolved]
        self._inbox.close(resolved)
        self._diagnostics.ignored(resolved)
        self.topic_changes += 1
        self.destroy_subscription(self._subscribed.pop(resolved))

    def serve(self, service_type: Any, name: str, handler: Callable[[Any, Any], Any]) -> None:
        """Offer a service; ``handler`` takes request and response, and is called at once."""

        def answer(request: Any, response: Any) -> Any:
            self._notice_standstill(time.perf_counter())
            try:
                return handler(request, response)
            finally:
                self._worked_s = time.perf_counter()

        self.create_service(service_type, name, answer)

    # ---------------------------------------------------------------- work
    def tick(self, now_ns: int | None = None) -> None:
        """Hand the stored messages to their handlers, in order, then compute.

        Args:
            now_ns: The time, in lock-step only.
        """
        if now_ns is not None:
            self._lockstep_now_ns = now_ns
        if self._variants is None:
            self._variants = compiled_variants()
            self.started_ns = self.now_ns()
        start = time.perf_counter()
        self._notice_standstill(start)
        self.tick_ns = self.now_ns()
        self._ahead_ns = self.tick_ns - time.time_ns()
        self.take()
        self._inbox.hand_over()
        self._asked_s = time.perf_counter()  # before the time is read: a hold-up in between counts
        now = self.now_ns()
        self.on_tick(now)
        self._worked_s = time.perf_counter()
        self._diagnostics.ticked(self._worked_s - start, self.period_s)
        if now >= self._next_diagnostics_ns:
            starting = not self.lockstep and 0 <= now - self.started_ns < STARTING_NS
            self._diagnosed_ns = now
            self._next_diagnostics_ns = now + (STARTING_PERIOD_NS if starting else NANO)
            self._diagnostics.tell(now)
        elif self._next_diagnostics_ns - now > 2 * NANO:  # the clock went back
            self._next_diagnostics_ns = now

    def _notice_standstill(self, now_s: float) -> None:
        """Say so when the timer came much too late: not this node's work but the machine's."""
        gap = now_s - self._worked_s
        most = max(STANDSTILL_S, 10 * self.period_s)
        if self._timer is None or not self._worked_s or gap <= most:
            return
        if self._timer.clock.clock_type == ClockType.ROS_TIME:
            return  # /clock may stand still
        why = "is the machine overloaded, or was it stopped by a signal?"
        self.fault("standstill", f"this node {STANDSTILL} {gap:.2f} s: {why}")

    def on_tick(self, now_ns: int) -> None:
        """Compute and publish; called once a tick, after the message handlers."""
        raise NotImplementedError

    def held_s(self) -> float:
        """How long ago the time was read that this tick computes with, by a steady clock [s].

        In lock-step 0: time stands still within a tick.
        """
        return 0.0 if self.lockstep else time.perf_counter() - self._asked_s

    def settled(self) -> bool:
        """Whether all that services and actions owe this node now has come: lock-step waits for it."""
        return True

    def close(self) -> None:
        """Stop own threads and files; called once before the node is destroyed."""

    # ---------------------------------------------------------------- health
    def fault(self, key: str, text: str, level: bytes = WARN) -> None:
        """Note a fault: said in the log when it is new, on /diagnostics at once and for five seconds."""
        if self._diagnostics.fault(key, text, level):
            soon_ns = self._diagnosed_ns + NEWS_PERIOD_NS
            self._next_diagnostics_ns = min(self._next_diagnostics_ns, soon_ns)
            if level == ERROR:  # two calls: rclpy refuses another severity from the same one
                self.get_logger().error(text)
            else:
                self.get_logger().warning(text)

    @property
    def faults(self) -> tuple[str, ...]:
        """Texts of the faults of the last seconds, one a kind, the newest of each."""
        return self._diagnostics.faults

    def compiled_late(self) -> list[str]:
        """Kernels that were compiled (or loaded) after the first tick, while the graph waited."""
        if self._variants is None:
            return []
        before = self._variants
        return [name for name, count in compiled_variants().items() if count > before.get(name, 0)]

    def take_precedence(self) -> None:
        """Let this process have the priority that the node's parameter says."""
        self.scheduling = take_precedence(self._realtime_priority)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Level, summary and figures for /diagnostics; nodes extend it."""
        return OK, "running", {}


def run_node(make: Callable[[], HriNode], args: list[str] | None = None) -> int:
    """Run one node as a process until Ctrl-C, SIGTERM or shutdown.

    The events executor takes as long for a callback however many there are; the default one does not.

    Args:
        make: Builds the node; called after rclpy is initialised.
        args: Command line; ``sys.argv`` when not given.

    Returns:
        Exit code: 0, or 1 when the node could not start (one line on stderr says why).
    """
    from rclpy.experimental.events_executor import EventsExecutor

    # rclpy's own handlers shut the context down under a running tick, whose messages then fail.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    end = EndSignal()
    node: HriNode | None = None
    executor = None
    code = 0
    try:
        node = make()
        refuse_undeclared(node)
        executor = EventsExecutor()
        executor.add_node(node)
        # The first message of a logger looks through all modules for its caller, for 50 ms: not then,
        # as it mostly says why the robot stops.
        inspect.getframeinfo(sys._getframe())
        # What start-up made stays: the collector need not walk it while the node runs.
        gc.collect()
        gc.freeze()
        end.interrupt = False
        node.take_precedence()  # not before: importing and compiling are to keep nobody waiting
        print(ready_line(node), flush=True)
        while rclpy.ok() and not end.asked:
            executor.spin_once(timeout_sec=0.1)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except HriError as error:
        print(f"{node.get_name() if node else 'node'}: {error}", file=sys.stderr, flush=True)
        code = 1
    finally:
        end.interrupt = False
        if node is not None:
            node.close()
        # All that is the node's own is closed. Middleware that does not let go is not waited for: where
        # it hangs is said on stderr.
        faulthandler.dump_traceback_later(TEARDOWN_S, exit=True)
        if executor is not None:
            executor.shutdown()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
        faulthandler.cancel_dump_traceback_later()
    return code
