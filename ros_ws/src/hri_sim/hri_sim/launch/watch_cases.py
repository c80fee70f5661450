"""Two people who are watched live by node processes, in real time, and a listener.

The dyad node sends both arms 250 times a second, stamped by this machine's clock; the monitor is held to
one core.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import rclpy
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node

from hri_prediction.ros.messages import InteractionCase
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import to_ns
from hri_sim.launch.deaths import NodeDeath
from hri_sim.launch.parameters import complete_parameters, read_parameters
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.ontology.live import Heard, figures_of, live_summary, settled

TOPIC = "/interaction/case"
MONITOR, DYAD = "interaction_monitor", "dyad"
READY_S = 60.0
"""So long may the first movement take to be told of [s]."""


def _heard(message: InteractionCase, meant: int) -> Heard:
    return Heard(
        time.time_ns(),
        message.state == InteractionCase.COMPLETE,
        message.first,
        message.number,
        message.group,
        to_ns(message.onset),
        to_ns(message.end),
        to_ns(message.newest_sample),
        to_ns(message.header.stamp),
        meant,
    )


def listen_live(folder: Path, case: int, seed: int, seconds: float) -> list[Heard]:
    """Start a dyad and the monitor, and listen.

    Args:
        folder: For logs and parameters.
        case: What the two do.
        seed: Of the dyad.
        seconds: How long from the first movement on.

    Raises:
        GraphError: when a node is not installed.
        NodeDeath: when one ends meanwhile.
    """
    heard: list[Heard] = []
    context = Context()
    rclpy.init(context=context)
    node = Node("listener", context=context, start_parameter_services=False)

    def hear(message: InteractionCase) -> None:
        # Without an end it is about no movement.
        if message.state != InteractionCase.NONE or to_ns(message.end):
            heard.append(_heard(message, case))

    node.create_subscription(InteractionCase, TOPIC, hear, reliable(50))
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    specs = [
        NodeSpec("hri_prediction", MONITOR),
        NodeSpec("hri_sim", DYAD, {"seed": seed, "case": case, "pause": 0.4}),
    ]
    try:
        with Supervisor(folder) as supervisor:
            supervisor.start(complete_parameters(specs, read_parameters(None), ""))
            core = min(os.sched_getaffinity(0))
            os.sched_setaffinity(supervisor.pids[MONITOR], {core})
            until = time.monotonic() + READY_S
            begun = False
            while time.monotonic() < until:
                executor.spin_once(timeout_sec=0.05)
                for death in supervisor.deaths():
                    raise NodeDeath(death)
                if not begun and any(told.complete for told in heard):
                    begun, until = True, time.monotonic() + seconds
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    return settled(heard)


def measure_live(
    folder: Path, cases: tuple[int, ...], seed: int, seconds: float
) -> dict[str, float | int]:
    """Several dyads in turn; of no times where no case was told.

    Args:
        folder: For logs and parameters.
        cases: What they do.
        seed: Of the first; the others follow.
        seconds: How long each is watched.

    Raises:
        NodeDeath: when a node ends meanwhile.
    """
    heard: list[Heard] = []
    for number, case in enumerate(cases):
        own = folder / f"case_{case}"
        own.mkdir(parents=True, exist_ok=True)
        heard += listen_live(own, case, seed + number, seconds)
    return live_summary(figures_of(heard))
