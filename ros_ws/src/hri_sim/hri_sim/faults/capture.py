"""Motion capture goes wrong while the robot moves past a person."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from hri_planner.separation.config import MEASURED, PREDICTED
from hri_prediction.ros.messages import HumanPrediction
from hri_sim.faults.motion import (
    AT_REST,
    NAMED,
    POLICY,
    PREDICTION,
    PTOMP,
    REACHED,
    SAFE,
    WILD,
    Motion,
    arm_beside,
    lockstep,
    scene,
)
from hri_sim.launch.separation import OFF
from hri_sim.reliability.fault import LOCKSTEP, Fault, Figure, Place, Trial
from hri_sim.testing import node_factory, spoiling
from hri_sim.testing.spoiling import REMAP, Bystander, Spoil, Tamper

VALID = Figure("valid", "predictions that are valid while nothing can be seen", limit=0.0)
SAYS = Figure("predictor_ms", "named by the predictor, if there is one, after", "ms", 1000.0)
BLIND_S = 0.3
"""A prediction may count on samples that are as old as this: it looks ahead from them [s]."""
GRAPHS = ((PTOMP, OFF), (PTOMP, MEASURED), (POLICY, OFF), (PTOMP, PREDICTED), (POLICY, MEASURED))
"""What moves the robot, and the monitor beside it: each in turn, by the seed."""


@dataclass(frozen=True)
class Spoiling:
    """A way in which motion capture goes wrong.

    Attributes:
        name: Of the fault.
        make: Makes what spoils samples.
        seconds: The shortest and the longest that it lasts.
        words: What is said of it: one of them.
        stops: Whether the robot must come to rest.
    """

    name: str
    make: Callable[[np.random.Generator], Spoil]
    seconds: tuple[float, float]
    words: tuple[str, ...]
    stops: bool


def spoil(spoiling_: Spoiling, seed: int, place: Place) -> Trial:
    """One repetition, with one of the graphs."""
    mover, monitor = GRAPHS[seed % len(GRAPHS)]
    options: dict[str, Any] = {"remappings": REMAP, "sensors": [Tamper], "separation": monitor}
    with Motion(seed, place, spoiling_.name, mover=mover, **options) as motion:
        handle = motion.under_way()
        seconds = motion.rng.uniform(*spoiling_.seconds)
        tamper = motion.graph.nodes["tamper"]
        assert isinstance(tamper, Tamper)
        motion.mark()
        tamper.spoil(spoiling_.make(motion.rng), seconds)
        motion.graph.run(seconds)
        figures: dict[str, float | None] = {}
        if spoiling_.stops:
            figures["rest_ms"] = motion.rest_ms()
        if spoiling_.stops and mover == PTOMP:  # a policy needs no predictions
            late = [
                m
                for now_ns, m in motion.timed(PREDICTION)
                if motion.begin_s + BLIND_S < now_ns * 1e-9 < motion.begin_s + seconds
            ]
            figures["valid"] = float(sum(m.state != HumanPrediction.INVALID for m in late))
        outcome = motion.finish(handle)
        motion.graph.run(1.0)  # all have told of themselves once more
        named_ms, said = motion.named(*spoiling_.words)
        if PREDICTION in motion.graph.log:
            figures["predictor_ms"], _ = motion.named(*spoiling_.words, by="predictor")
        figures |= {"named_ms": named_ms, "wild": motion.wild()}
        figures["reached"] = float(outcome == "reached")
        return Trial(seed, {**figures, **motion.safe()}, f"{said} ({outcome})")


def second_body(seed: int, place: Place) -> Trial:
    """Somebody else is there, holding an arm still beside the robot."""
    arm = arm_beside(seed, scene(seed, place.keep)[0])
    sensors, monitor = [node_factory(Bystander, arm)], (OFF, MEASURED, PREDICTED)[seed // 3 % 3]
    with Motion(seed, place, "bodies", sensors=sensors, separation=monitor) as motion:
        motion.graph.run(0.6)
        motion.mark()
        outcome = motion.finish(motion.start(), 25.0)
        rates = [
            len(motion.since(f"/humans/bodies/{body}/prediction"))
            / (motion.graph.now_s - motion.begin_s)
            for body in ("person1", "bystander")
        ]
        figures: dict[str, float | None] = {
            "rate_hz": min(rates),
            "clear_cm": motion.clearance_to(arm) * 100.0,
            "ended": float(outcome in ("reached", "blocked")),
            "wild": motion.wild(),
        }
        return Trial(seed, {**figures, **motion.safe()}, outcome)


def _stopping(name: str, title: str, injected: str, how: Spoil, *words: str) -> Fault:
    spoiling_ = Spoiling(name, partial(_always, how), (0.5, 1.0), words, True)
    return Fault(
        name,
        title,
        f"{injected}, for 0.5 to 1 s, at a random time of a motion",
        "robot at rest, prediction (where there is one) invalid, named; afterwards the goal is reached",
        LOCKSTEP,
        (AT_REST, NAMED, SAYS, VALID, WILD, REACHED, *SAFE),
        lockstep(partial(spoil, spoiling_)),
        count=40,
    )


def _going_on(
    name: str,
    title: str,
    injected: str,
    make: Callable[[np.random.Generator], Spoil],
    *words: str,
) -> Fault:
    spoiling_ = Spoiling(name, make, (0.2, 0.8), words, False)
    return Fault(
        name,
        title,
        f"{injected}, for 0.2 to 0.8 s, at a random time of a motion",
        "named; no prediction that no arm can follow; nobody touched; the goal is reached",
        LOCKSTEP,
        (NAMED, SAYS, WILD, REACHED, *SAFE),
        lockstep(partial(spoil, spoiling_)),
        count=40,
    )


def _always(how: Spoil, rng: np.random.Generator) -> Spoil:
    return how


def _shifted(low: float, high: float, rng: np.random.Generator) -> Spoil:
    return spoiling.shifted_clock(rng.uniform(low, high))


def _clock(name: str, title: str, low: float, high: float, *words: str) -> Fault:
    fault = _stopping(name, title, f"stamps are off by {low:g} to {high:g} s", spoiling.silent)
    spoiling_ = Spoiling(name, partial(_shifted, low, high), (0.5, 1.0), words, True)
    return replace(fault, measure=lockstep(partial(spoil, spoiling_)))


_NO_SAMPLE = ("no usable sample", "last seen", "newest sample")
CAPTURE = (
    _stopping("mocap_silence", "motion capture falls silent", "no sample comes", spoiling.silent,
              *_NO_SAMPLE),
    _stopping("mocap_unseen", "the arm is not seen", "no keypoint is valid", spoiling.blind, *_NO_SAMPLE),
    _stopping("mocap_nan", "NaN from motion capture", "all keypoints are NaN, and said to be valid",
              spoiling.not_a_number, "not finite"),
    _going_on("mocap_outliers", "outliers", "a tenth of the samples has a keypoint 0.2 to 2 m away",
              spoiling.outliers, "jump", "m long"),
    _going_on("mocap_swapped", "swapped markers", "elbow and wrist are exchanged",
              partial(_always, spoiling.swapped), "swapped", "jump"),
    Fault(
        "two_bodies", "two bodies", "a second body holds an arm beside the robot, within 8 cm of a place",
        "both are predicted and kept clear of; the motion ends with a reason", LOCKSTEP,
        (
            Figure("rate_hz", "predictions of each a second", "Hz", 25.0, least=True, digits=1),
            Figure("clear_cm", "clear of the second body", "cm", 0.0, least=True, digits=1),
            Figure("ended", "reached, or blocked with a reason", limit=1.0, least=True),
            WILD,
            *SAFE,
        ),
        lockstep(second_body), count=40,
    ),
    _stopping("wrong_frame", "wrong frame", "samples are given in the frame of a camera",
              spoiling.in_frame("camera"), "'camera'", "frame"),
    _stopping("wrong_units", "wrong units", "millimetres instead of metres", spoiling.millimetres,
              "metres", "plausible"),
    _going_on("late_stamps", "late and reordered samples",
              "samples are held for 4 to some 100 ms, and come in any order", spoiling.late_and_reordered,
              "late or repeated sample"),
    _clock("source_clock_back", "the source's clock goes back", -3.0, -0.5, "stamps went back",
           *_NO_SAMPLE),
    _clock("source_clock_ahead", "the source's clock runs ahead", 0.5, 10.0, "in the future"),
)  # fmt: skip
"""Faults of motion capture."""
