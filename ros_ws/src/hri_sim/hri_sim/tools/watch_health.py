"""Command line of ``scripts/watch_health.py``: how every node does, and what to do about it."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from datetime import datetime
from typing import Annotated, Any

import rclpy
import typer
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import install_signal_handlers, uninstall_signal_handlers
from rich.console import Console, RenderableType
from rich.live import Live
from rich.text import Text

from hri_sim.health.figures import NodeStatus
from hri_sim.health.processes import stopped_nodes
from hri_sim.health.screen import STATES, screen, to_mapping
from hri_sim.health.watch import Row, Watch, all_gone, exit_code
from hri_sim.tools.discovery import discovery, domain

DISCOVERY_S = 3.5
"""When nobody was heard for so long, that is said [s]; nodes announce themselves every 3 s."""
ONCE_S = 5.0
"""How long ``--once`` listens: nodes speak each second, and rates take two of these [s]."""
_LOOK_S = 1.0
_REFRESH_S = 0.5
_WIDTH = 160
"""Columns where the output is no terminal."""
_WIDEST = 160

_HELP = """Show how every node does: state, timing, late inputs, losses, and what to do about it.

Green: OK. Yellow: WARN. Red: ERROR. Magenta: STALE, it has said nothing for 2 s or is gone. A table that is
drawn anew on a terminal, plain text each second elsewhere. Nodes of this machine that a signal has stopped
have a row, also when the graph has forgotten them. A node that was gone before this began is not known:
name those that have to be there with --node.

\b
  tick      what ticks take, median and 99th percentile, and their period
  overruns  ticks that took longer than that
  input     the one that is oldest against its own rate
  drops     messages that came and were lost
  (+n)      of these, within the last 10 s

\b
examples:
  watch_health.py                                 until Ctrl-C
  watch_health.py --once && echo all is well      for scripts
  watch_health.py --once --node recorder          1 when there is none
  watch_health.py --duration 60 --json > health.jsonl
"""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


class _Ear:
    """A node that hears /diagnostics, and looks who is there."""

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._context = Context()
        rclpy.init(context=self._context, args=[])
        install_signal_handlers()
        self._node = rclpy.create_node("watch_health", context=self._context, enable_rosout=False)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)

        def hear(message: DiagnosticArray) -> None:
            for status in message.status:
                values = {item.key: item.value for item in status.values}
                said = NodeStatus(status.name, status.level[0], status.message, values)
                watch.hear(said, time.monotonic())

        self._node.create_subscription(DiagnosticArray, "/diagnostics", hear, QoSProfile(depth=200))

    def listen(self, until_s: float) -> None:
        """Hear what comes until a time of the monotonic clock [s].

        Raises:
            ExternalShutdownException: after Ctrl-C or SIGTERM.
        """
        while (left_s := until_s - time.monotonic()) > 0.0:
            if not rclpy.ok(context=self._context):
                raise ExternalShutdownException
            self._executor.spin_once(timeout_sec=min(left_s, 0.1))

    def look(self) -> None:
        """See who is there, and who sends what."""
        self._watch.look(self._publishers("/diagnostics"), time.monotonic())
        topics = self._watch.sole_topics
        self._watch.look_at_sources({topic: self._publishers(topic) for topic in topics})
        self._watch.look_at_processes(stopped_nodes(os.environ))

    def _publishers(self, topic: str) -> list[str]:
        """Full names of the nodes that publish a topic, one a publisher."""
        return [
            f"{item.node_namespace.rstrip('/')}/{item.node_name}"
            for item in self._node.get_publishers_info_by_topic(topic)
            if not item.node_name.startswith("_NODE_")  # not found out yet
        ]

    def others(self) -> list[str]:
        """Names of all other nodes."""
        names = self._node.get_fully_qualified_node_names()
        return sorted(set(names) - {self._node.get_fully_qualified_name()})

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)
        uninstall_signal_handlers()


def nobody(others: list[str]) -> str:
    """What is said where no node speaks; ``others`` are nodes that are there all the same."""
    text = (
        f"no node speaks on /diagnostics in ROS domain {domain(os.environ)}; looked for "
        f"{discovery(os.environ)}. Start a graph (scripts/launch_ptomp.py, scripts/run_node.py), or give "
        "this terminal the ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE of the graph's."
    )
    return f"{text} Nodes that do not say how they are: {', '.join(others)}." if others else text


def _head(rows: list[Row]) -> str:
    counts = [
        (STATES[level], sum(row.level == level for row in rows)) for level in reversed(STATES)
    ]
    found = ", ".join(f"{count} {state}" for state, count in counts if count)
    return f"{datetime.now():%H:%M:%S}  ROS domain {domain(os.environ)}: {found}"


class _Output:
    """Shows rows: live on a terminal, as plain text elsewhere, or as one line of JSON.

    Args:
        as_json: Whether as JSON.
        live: Whether a terminal is drawn anew, instead of once.
    """

    def __init__(self, *, as_json: bool, live: bool) -> None:
        self._json = as_json
        self._console = Console()
        if not self._console.is_terminal and "COLUMNS" not in os.environ:
            self._console.width = _WIDTH
        self._console.width = min(self._console.width, _WIDEST)
        drawn = live and not as_json and self._console.is_terminal
        self._live = Live(console=self._console, auto_refresh=False) if drawn else None
        self._told = self._ended = False
        self.period_s = _REFRESH_S if drawn else _LOOK_S

    def open(self) -> AbstractContextManager[Any]:
        """In which things are shown."""
        return self._live or nullcontext()

    def show(self, rows: list[Row], missing: Callable[[], str]) -> None:
        """Show rows; ``missing`` says why there are none, and is empty while that is not known yet."""
        if self._json:
            about = {"time": datetime.now().astimezone().isoformat(timespec="milliseconds")}
            about |= {"domain": domain(os.environ), "discovery": discovery(os.environ)}
            nodes = [to_mapping(row) for row in rows]
            print(json.dumps(about | {"exit_code": exit_code(rows), "nodes": nodes}), flush=True)
        had_ended, self._ended = self._ended, all_gone(rows)
        if not rows:
            why = missing()
            if self._live is not None:
                self._draw(Text(why or "listening …"))
            elif why and not self._told:
                self._told = True
                print(why, file=sys.stderr, flush=True)
        elif not self._json and not (had_ended and self._ended and self._live is None):
            # Text is not repeated for a graph that has ended.
            self._draw(screen(rows, _head(rows), self._console.width))

    def _draw(self, what: RenderableType) -> None:
        if self._live is not None:
            self._live.update(what, refresh=True)
        else:
            self._console.print(what, Text(), highlight=False)


def _watch(
    ear: _Ear, watch: Watch, output: _Output, *, once: bool, until_s: float | None
) -> list[Row]:
    """Listen and show until then; for good, when that is none. The rows as they were last."""
    begin_s = next_look_s = time.monotonic()

    def missing() -> str:
        late = time.monotonic() - begin_s > DISCOVERY_S or over
        return nobody(ear.others()) if late else ""

    over = False
    rows: list[Row] = []
    while not over:
        step_s = time.monotonic() + output.period_s
        ear.listen(step_s if until_s is None else min(step_s, until_s))
        now_s = time.monotonic()
        over = until_s is not None and now_s >= until_s
        if now_s >= next_look_s or over:
            next_look_s = now_s + _LOOK_S
            ear.look()
        rows = watch.rows(now_s)
        if over or not once:
            output.show(rows, missing)
    return rows


@app.command(
    help=_HELP,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes with --once or --duration, for how things were at the end: 0 every node is OK; "
    "1 a node is at ERROR, silent, gone or not there, or none was heard; 2 wrong arguments; 3 nothing is "
    "worse than WARN. Without them it runs until Ctrl-C, and ends with 0.",
)
def watch_health(
    once: Annotated[
        bool, typer.Option("--once", help=f"Print one table, after --duration ({ONCE_S:g} s).")
    ] = False,
    duration: Annotated[
        float | None,
        typer.Option(help="End after so many seconds.", min=0.1, max=1e6, metavar="S"),
    ] = None,
    node: Annotated[
        list[str] | None,
        typer.Option(
            help="Only this node, with or without its namespace; again for more. One that is not "
            "there is at STALE.",
            metavar="NAME",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON object a second, each on a line of its own.")
    ] = False,
) -> None:
    """Show how every node does; :data:`_HELP` says more."""
    watch = Watch(node or ())
    output = _Output(as_json=as_json, live=not once)
    limit_s = ONCE_S if once and duration is None else duration
    try:
        with closing(_Ear(watch)) as ear, output.open():
            until_s = None if limit_s is None else time.monotonic() + limit_s
            rows = _watch(ear, watch, output, once=once, until_s=until_s)
    except (KeyboardInterrupt, ExternalShutdownException, BrokenPipeError):
        raise typer.Exit(0) from None
    raise typer.Exit(exit_code(rows))


def main(argv: list[str] | None = None) -> int:
    """Entry point; the exit code goes through :class:`SystemExit`."""
    app(args=argv, prog_name="watch_health.py")
    return 0


if __name__ == "__main__":
    sys.exit(main())
