"""Test a node of your own in lock-step with nodes of this graph.

``WristSpeed`` stands for your node: it listens to a tracked arm and publishes the speed of the
wrist. The test runs it with the simulated person in one process; time advances by counting
messages, so no sleep, no timeout and no luck is involved, and equal seeds give equal bytes.

    scripts/_run_in_env python -m pytest examples/test_own_node.py
    scripts/_run_in_env python examples/test_own_node.py
"""

from __future__ import annotations

import argparse
from collections import deque
from typing import Any

import numpy as np
from std_msgs.msg import Float64

from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import to_ns
from hri_sim.nodes.person_node import PersonNode
from hri_sim.scenario.shipped import load_shipped
from hri_sim.testing import Graph, cue, node_factory

PERIOD_S = 0.02
WINDOW = 25
"""Samples (0.1 s) over which the speed is taken: 2 mm of noise would hide it in fewer."""
TOPIC = "/wrist_speed"


class WristSpeed(HriNode):
    """Publishes the speed of a person's wrist, 50 times a second."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("wrist_speed", period_s=PERIOD_S, **kwargs)
        self._speed = self.announce(Float64, "wrist_speed", reliable(10))
        self._arms: deque[HumanArm] = deque(maxlen=WINDOW)
        # Handlers run on the tick, in the order of the stamps: no locks, no races.
        self.listen(HumanArm, "humans/bodies/person1/arm", self._arms.append, SENSOR)

    def on_tick(self, now_ns: int) -> None:
        """Speed over the newest samples that show the wrist."""
        seen = [arm for arm in self._arms if arm.valid[2]]
        if len(seen) < WINDOW // 2:
            return
        first, last = seen[0], seen[-1]
        elapsed = (to_ns(last.header.stamp) - to_ns(first.header.stamp)) * 1e-9
        moved = np.subtract(last.keypoints[6:9], first.keypoints[6:9])
        self._speed.publish(Float64(data=float(np.linalg.norm(moved)) / elapsed))


def run(seed: int) -> tuple[list[float], list[tuple[int, bytes]]]:
    """Two seconds with a reach of one second: the speeds, and (time of the step, CDR bytes)."""
    person = node_factory(PersonNode, parameters={"seed": seed})
    with Graph([person, WristSpeed]) as graph:
        graph.run(seconds=0.2)
        cue(graph, load_shipped("table_reach"), 0)  # the scene that the person node sits in
        graph.run(seconds=1.8)
        speeds = [message.data for message in graph.messages(TOPIC)]
        return speeds, graph.log[TOPIC]


def test_one_message_a_period_and_the_reach_shows() -> None:
    """The node speaks on every tick, and its figures follow the person."""
    speeds, log = run(seed=1)
    assert len(speeds) == len(log) >= 90  # of 100 ticks: the first ones have too few samples
    assert 0.3 < max(speeds) < 0.8
    assert np.median(speeds[-15:]) < 0.1


def test_same_seed_same_bytes() -> None:
    """Runs are repeatable down to the bytes, and the seed matters."""
    assert run(seed=1) == run(seed=1)
    assert run(seed=1) != run(seed=2)


if __name__ == "__main__":
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    for number in (1, 2):
        found, _ = run(number)
        print(
            f"seed {number}: {len(found)} messages, fastest {max(found):.2f} m/s, "
            f"{np.median(found[-15:]):.2f} m/s at the end"
        )
    test_one_message_a_period_and_the_reach_shows()
    test_same_seed_same_bytes()
    print("the same seed gave the same bytes")
