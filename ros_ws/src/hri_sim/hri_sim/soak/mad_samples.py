"""What a motion capture system that has gone mad sends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_sim.scenario.schema import PersonSpec
from hri_sim.soak.faults import CLOCK, FRAME, JUMP, NAN

FloatArray = NDArray[np.float64]

PERIOD_S = 0.02
"""Time between two such samples, among those that are right [s]."""
BACK_NS = 1_000_000_000
JUMP_M = (0.0, 0.5, 0.0)


@dataclass(frozen=True, eq=False)
class MadSample:
    """One sample.

    Attributes:
        keypoints: Of the arm (4, 3) [m].
        frame: What it says that its frame is; empty: the right one.
        back_ns: By so much its stamp is too old [ns].
    """

    keypoints: FloatArray
    frame: str = ""
    back_ns: int = 0


def mad_sample(kind: str, person: PersonSpec) -> MadSample:
    """A sample of a person's arm at home, with a fault.

    Args:
        kind: One of the faults of motion capture.
        person: Whose arm.
    """
    arm = person.arm.posture(np.array(person.home), person.swivel)
    if kind == NAN:
        return MadSample(np.full((4, 3), np.nan))
    if kind == FRAME:
        return MadSample(arm, frame="camera")
    if kind == CLOCK:
        return MadSample(arm, back_ns=BACK_NS)
    assert kind == JUMP, kind
    return MadSample(arm + np.array(JUMP_M))
