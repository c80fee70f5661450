"""A person who watches the robot and, when sure, says where it is going.

Bayesian goal inference from the way so far (Dragan & Srinivasa 2013): with the length of a way as its
cost, that of what has been seen is the same for all goals, so what counts is how much nearer each has
come: P(g) ~ P_0(g) exp(k (|s - g| - |x - g|)) with the start s and the tool at x. The other kind goes by
the heading: it adds up how much of each movement is towards each goal, and forgets.

The tool is seen with an error that wanders. A goal must be likely enough for a while; then it takes a
reaction time until the person shows it. When the robot has come to rest, it is the goal next to the tool.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_sim.readability.traits import Traits

FloatArray = NDArray[np.float64]

MOVED_M = 0.004
"""The robot has begun to move when its tool is so far from the start [m]."""
RESTS_M, RESTS_S = 0.002, 0.25
"""It has come to rest when for so long [s] it has moved by no more [m]."""


@dataclass(frozen=True)
class Decision:
    """What a person has made of a motion.

    Attributes:
        goal: Index of the goal.
        sure_s: When the person was sure [s].
        shown_s: When that shows: the key is pressed, or the hand begins to move [s].
    """

    goal: int
    sure_s: float
    shown_s: float


class Observer:
    """Watches one motion.

    Args:
        traits: Of the person.
        start: Where the tool begins (3,) [m].
        goals: Where it may go (n, 3) [m].
        rng: Draws noise and reaction time.

    Attributes:
        decision: What the person decided; none so far.

    Raises:
        DataError: when shapes do not fit.
    """

    def __init__(
        self, traits: Traits, start: FloatArray, goals: FloatArray, rng: np.random.Generator
    ) -> None:
        self.traits = traits
        self._start, self._goals = np.array(start, dtype=float), np.array(goals, dtype=float)
        prior = np.array(traits.prior) if traits.prior else np.zeros(len(self._goals))
        if prior.shape != (len(self._goals),):
            raise DataError(
                f"prior of {len(prior)} goals", expected=f"{len(self._goals)}, one for each"
            )
        self._prior = prior
        self._rng = rng
        self._noise = traits.noise * rng.standard_normal(3)
        self._evidence = np.zeros(len(self._goals))
        self._seen: FloatArray | None = None
        self._last_s = -math.inf
        self._likely: tuple[int, float] | None = None
        self._place = self._start
        self._since_s = math.inf
        self._begun = False
        self.decision: Decision | None = None

    @property
    def probabilities(self) -> FloatArray:
        """Of the goals (n,), from what was seen so far."""
        scores = self._prior.copy()
        if self._seen is not None:
            if self.traits.kind == "bayesian":
                before = np.linalg.norm(self._goals - self._start, axis=1)
                left = np.linalg.norm(self._goals - self._seen, axis=1)
                scores += self.traits.rationality * (before - left)
            else:
                scores += self.traits.attention * self._evidence
        found: FloatArray = np.exp(scores - np.logaddexp.reduce(scores))
        return found

    def watch(self, time_s: float, tool: FloatArray) -> Decision | None:
        """See the tool (3,) [m] at a time [s]; earlier times than before are not looked at.

        Returns:
            The decision, from the moment on when it is made.
        """
        if time_s <= self._last_s or not np.isfinite(tool).all():
            return self.decision
        dt = min(time_s - self._last_s, 0.1)
        self._last_s = time_s
        if self.decision is not None:
            return self.decision
        self._see(dt, tool)
        if np.linalg.norm(tool - self._place) > RESTS_M:
            self._place, self._since_s = np.array(tool), time_s
        if not self._begun:
            self._begun = float(np.linalg.norm(tool - self._start)) > MOVED_M
            return None
        likely = self.probabilities
        best = int(np.argmax(likely))
        if time_s - self._since_s >= RESTS_S:
            self._decide(int(np.argmin(np.linalg.norm(self._goals - tool, axis=1))), time_s)
        elif likely[best] < self.traits.threshold:
            self._likely = None
        elif self._likely is None or self._likely[0] != best:
            self._likely = (best, time_s)
        elif time_s - self._likely[1] >= self.traits.hold:
            self._decide(best, time_s)
        return self.decision

    def _see(self, dt: float, tool: FloatArray) -> None:
        traits = self.traits
        keep = math.exp(-dt / traits.noise_time)
        drawn = self._rng.standard_normal(3)
        self._noise = keep * self._noise + traits.noise * math.sqrt(1.0 - keep * keep) * drawn
        seen = tool + self._noise
        if self._seen is not None and traits.kind == "heading":
            ways = self._goals - seen
            ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-6)
            self._evidence *= math.exp(-dt / traits.forgetting)
            self._evidence += ways @ (seen - self._seen)
        self._seen = seen

    def _decide(self, goal: int, time_s: float) -> None:
        reaction = self.traits.reaction * math.exp(
            self.traits.reaction_spread * float(self._rng.standard_normal())
        )
        self.decision = Decision(goal, time_s, time_s + reaction)
