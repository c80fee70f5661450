"""A movement of one of two people, as it is cut out of what both do."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Segment:
    """A movement of one of the two.

    Attributes:
        agent: Whose wrist moved, 0 or 1.
        onset_ns: When it began, on the clock of the samples [ns].
        end_ns: When it was over [ns].
        features: Their means (25,) [m], this agent as agent 1; none where there is a reason.
        reason: Why there are none; empty where there are.
    """

    agent: int
    onset_ns: int
    end_ns: int
    features: FloatArray | None
    reason: str = ""

    @property
    def kind(self) -> str:
        """The reason without its figures."""
        words = re.sub(r"(: [\d.]+ s| by [\d.]+ m?s?)$", "", self.reason)
        words = re.sub(r"for \d+ % of it", "for too little of it", words)
        return re.sub(r" at [\d.e+-]+ Hz, too seldom", " too seldom", words)
