"""What a video shows beside robot and arms: trunks, targets, the tool's trail, predictions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import load_robot
from hri_sim.media.frames import RunRecord
from hri_sim.media.look import BLUE, target_shape, torso_shape, tube_shape
from hri_sim.media.raycast import Capsules

FloatArray = NDArray[np.float64]

TRAIL_S = 2.0
"""How long the tool's path stays visible [s]."""
FRESH_S = 0.2
"""How long a prediction stays visible without a newer one [s]."""
_STRIDE = 8
_NOTHING = Capsules(np.zeros((0, 2, 3)), np.zeros(0), np.zeros((0, 3)))


class Decorations:
    """Shapes for any time of a run."""

    def __init__(self, record: RunRecord) -> None:
        self._record = record
        scenario = record.scenario
        still = [torso_shape(person) for person in scenario.persons]
        self._still = Capsules.joined([*still, target_shape(record.goal_places)])
        self._tool = load_robot().frames(record.q)[:, 3]

    def at(self, time_s: float) -> tuple[Capsules, Capsules]:
        """Opaque and translucent capsules at a time [s]."""
        record = self._record
        recent = np.flatnonzero((record.time_s <= time_s) & (record.time_s > time_s - TRAIL_S))
        # Always the same samples, so that the trail does not shimmer.
        trail = self._tool[recent[recent % _STRIDE == 0]]
        solid = [self._still]
        if len(trail) > 1:
            solid.append(Capsules.along(trail, 0.004, BLUE))
        made = [mark for mark in record.predictions if 0.0 <= time_s - mark.time_s < FRESH_S]
        glass = _NOTHING
        if made:
            glass = tube_shape(made[-1].mean[:, 2], made[-1].sigma[:, 2])
        return Capsules.joined(solid), glass

    def packed(self, times: FloatArray) -> dict[str, NDArray]:
        """All shapes of many times as plain arrays.

        Returns:
            ``solid_count``, ``glass_count`` (F,) and ``solid_shapes``, ``glass_shapes`` (S, 10):
            ends (6) [m], radius [m], colour (3).
        """
        pairs = [self.at(float(time_s)) for time_s in times]
        result: dict[str, NDArray] = {}
        for number, kind in enumerate(("solid", "glass")):
            shapes = [pair[number] for pair in pairs]
            everything = Capsules.joined(shapes)
            columns = (
                everything.ends.reshape(-1, 6),
                everything.radii[:, None],
                everything.colours,
            )
            result[f"{kind}_count"] = np.array([len(shape.radii) for shape in shapes])
            result[f"{kind}_shapes"] = np.concatenate(columns, axis=1)
        return result
