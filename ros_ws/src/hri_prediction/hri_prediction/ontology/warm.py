"""Compile what watches two people, before anything is timed."""

from __future__ import annotations

import numpy as np

from hri_prediction.ontology.watch import AGENTS, DyadWatch
from hri_prediction.tracks.track import ArmSample

_STEP_NS = 4_000_000


def warm_watch() -> None:
    """Let two arms move beside each other for a moment."""
    watch, arm = DyadWatch(), np.zeros((4, 3))
    for step in range(60):
        arm = arm + 0.003
        for agent in AGENTS:
            seen = np.ones(4, dtype=bool)
            watch.push(agent, ArmSample(step * _STEP_NS, arm + agent, seen, "right"))
