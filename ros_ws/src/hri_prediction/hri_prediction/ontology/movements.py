"""Movements of two people beside each other, as joints of the one and keypoints of the other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.costs import LENGTH_M, path_costs
from hri_prediction.ontology.cutting import segments_of
from hri_prediction.ontology.piirl import Learnt, learn
from hri_prediction.ontology.sampling import BEYOND, draw_around
from hri_prediction.ontology.smoothing import smoothed_track, wide_enough
from hri_prediction.ontology.upper_body import UpperBody, body_of, joints_of
from hri_prediction.tracks.track import ArmTrack

FloatArray = NDArray[np.float64]

SMOOTHING_S = 0.08
"""Samples up to so far away are smoothed before joints are taken: third differences of joints make much
more of half a millimetre of noise than distances do, for which the watch's window is enough [s]."""
SAMPLES = 240
"""Drawn around each movement."""
SPREAD = np.array((0.0003,) * 3 + (0.0009,) * 11)
"""Standard deviations of what is drawn, where they are largest: of the first three joints [m], of the
others [rad]. The nearer, the less of what makes a draw dear is its own roughness, and the more how it leans
towards what is avoided: thirty times as far, the nearness that people avoid is not found."""
PENALTY = 0.1
"""Of the sum of the scaled weights."""
TRUNK = 7
"""Joints of trunk and shoulder girdle, the first of the fourteen: a robot on a table has none of them."""
ARM_SPREAD = np.where(np.arange(len(SPREAD)) < TRUNK, 0.0, SPREAD)
"""The same, with trunk and shoulder as they were: what an arm alone might have done."""


@dataclass(frozen=True, eq=False)
class Movement:
    """A movement of one of two people.

    Attributes:
        body: Whose.
        joints: Over time (n, 14).
        partner: Keypoints of the other one's arm at the same times (n, 4, 3) [m].
        step_s: Between two of these times [s].
        beyond: Joints at the three times before it, and the three after it (3, 14) each: hands are seldom
            at rest where movements are cut, and a sudden rest would be rougher than all of the movement.
            None: rest.
    """

    body: UpperBody
    joints: FloatArray
    partner: FloatArray
    step_s: float
    beyond: tuple[FloatArray, FloatArray] | None = None


def heading_of(keypoints: FloatArray) -> float:
    """Where somebody looks [rad]: to where the hand is on the average, seen from the shoulder."""
    way = np.nanmean(keypoints[:, 3] - keypoints[:, 0], axis=0)
    return math.atan2(float(way[1]), float(way[0]))


def movements_of(
    tracks: tuple[ArmTrack, ArmTrack], config: WatchConfig | None = None
) -> list[Movement]:
    """The movements of both in a recording, of which all of both arms is seen.

    Args:
        tracks: Of both, on the same clock and in the same frame.
        config: Of the segments; instants are as far apart as it says.
    """
    settings = config or WatchConfig()
    bodies = [body_of(t.keypoints, heading_of(t.keypoints), t.side) for t in tracks]
    found = []
    for segment in segments_of(tracks, settings):
        if segment.features is None:
            continue
        begin, end = segment.onset_ns * 1e-9, segment.end_ns * 1e-9
        times = np.arange(begin, end, settings.step)
        more = settings.step * np.arange(1, BEYOND + 1)
        times = np.concatenate((times[0] - more[::-1], times, times[-1] + more))
        whole, other = (
            smoothed_track(
                tracks[agent].time_s,
                tracks[agent].keypoints,
                times,
                wide_enough(tracks[agent].time_s, SMOOTHING_S),
                settings.max_gap,
            )
            for agent in (segment.agent, 1 - segment.agent)
        )
        inner = slice(BEYOND, -BEYOND)
        own, other = whole[inner], other[inner]
        if len(own) > 4 and np.isfinite(own).all() and np.isfinite(other).all():
            body = bodies[segment.agent]
            if np.isfinite(whole).all():
                joints = joints_of(body, whole)
                ends = joints[:BEYOND], joints[-BEYOND:]
                found.append(Movement(body, joints[inner], other, settings.step, ends))
            else:
                # A recording that begins or ends with it: nobody knows better than that it rests there.
                found.append(Movement(body, joints_of(body, own), other, settings.step))
    return found


def observed_range(movements: Sequence[Movement]) -> tuple[FloatArray, FloatArray]:
    """Least and greatest value of each joint in some movements (14,) and (14,)."""
    low = np.min([movement.joints.min(axis=0) for movement in movements], axis=0)
    high = np.max([movement.joints.max(axis=0) for movement in movements], axis=0)
    return low, high


def cost_scale(
    movements: Sequence[Movement],
    rng: np.random.Generator,
    spread: FloatArray = SPREAD,
    samples: int = 40,
) -> FloatArray:
    """How much each cost differs between some movements and what might have been done instead.

    Args:
        movements: What was done, one at least.
        rng: Draws the others.
        spread: How far these are, standard deviations (14,).
        samples: So many around each movement.

    Returns:
        Root mean squares of the differences (26,).

    Raises:
        DataError: without movements.
    """
    differences = cost_differences(movements, rng, spread, samples)
    found: FloatArray = np.sqrt(np.mean(differences**2, axis=0))
    return found


def cost_differences(
    movements: Sequence[Movement],
    rng: np.random.Generator,
    spread: FloatArray = SPREAD,
    samples: int = 40,
) -> FloatArray:
    """Costs of what might have been done less those of what was, as :func:`cost_scale` (s, 26)."""
    if not movements:
        raise DataError("no movements", expected="one at least")
    found = []
    for movement in movements:
        costs = _costs_around(movement, samples, spread, rng)
        found.append(costs[1:] - costs[0])
    return np.concatenate(found)


def _costs_around(
    movement: Movement,
    samples: int,
    spread: FloatArray,
    rng: np.random.Generator,
    limits: tuple[FloatArray, FloatArray] | None = None,
    length: float = LENGTH_M,
) -> FloatArray:
    """Costs of a movement, first, and of what is drawn around it (1 + samples, 26)."""
    others = draw_around(movement.joints, samples, spread, rng, limits)
    paths = np.concatenate((movement.joints[None], others))
    return path_costs(
        movement.body, paths, movement.partner, movement.step_s, length, movement.beyond
    )


def learn_costs(
    movements: Sequence[Movement],
    rng: np.random.Generator,
    *,
    samples: int = SAMPLES,
    spread: FloatArray = SPREAD,
    length: float = LENGTH_M,
    penalty: float = PENALTY,
) -> Learnt:
    """Weights of the costs by which people moved as they did.

    Args:
        movements: What they did.
        rng: Draws what they might have done instead.
        samples: So many of these around each movement.
        spread: How far these are, standard deviations (14,).
        length: Distance over which nearness falls to 1/e [m].
        penalty: λ of the weights.

    Raises:
        DataError: when there are no movements.
    """
    limits = observed_range(movements) if movements else None
    demonstrations, drawn = [], []
    for movement in movements:
        features = _costs_around(movement, samples, spread, rng, limits, length)
        demonstrations.append(features[0])
        drawn.append(features[1:])
    return learn(demonstrations, drawn, penalty)
