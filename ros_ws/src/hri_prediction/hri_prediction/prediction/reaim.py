r"""A change of mind in mid-reach: hypotheses that the hand was re-aimed a moment ago.

A filter that was conditioned on the way to one target cannot turn to another: all its weights have been
used up. So every tenth of a second hypotheses are begun afresh, one for each known end point and some
remaining times T: from where the hand is, with its velocity and acceleration, along the minimum-jerk
polynomial (Flash & Hogan 1985) to rest at that end,

.. math:: y(s) = h_p(s)\,p + h_v(s)\,v + h_a(s)\,a + h_e(s)\,e, \qquad e \sim N(\mu_{end}, \Sigma_{end})

Each is a Kalman filter over :math:`(p, v, a, e)`. Its weight is that of all that could have been before,
times the probability of a change, times the evidence since; so it stays small while the reach goes on as
begun, and takes over within some samples when it does not.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.prediction.library import DIMS, TaskModel
from hri_prediction.promp.filtering import kalman_step

Array = NDArray[np.float64]
TERMS = 4
"""Position, velocity, acceleration, end: weights of one dimension."""
SLOTS = 4
"""Moments of a change that are held side by side."""
SPACING_S = 0.1
"""Time between these moments, and length of the history that each begins with [s]."""
REMAINING = (0.45, 0.65, 0.9, 1.2)
"""Times that a re-aimed hand still needs, as shares of the usual duration of the task."""
RULED_OUT = -40.0
"""Log probability below which a hypothesis is not followed any more."""
_POSITION_SD, _VELOCITY_SD, _ACCELERATION_SD = 0.3, 2.0, 10.0


@njit
def hermite_row(time: float, remaining: float, out: Array) -> None:
    """Write how position, velocity, acceleration and end (4,) count ``time`` seconds after the change."""
    s = time / remaining
    if s <= 0.0:
        out[0], out[1], out[2], out[3] = 1.0, time, 0.5 * time * time, 0.0
        return
    if s >= 1.0:
        out[0], out[1], out[2], out[3] = 0.0, 0.0, 0.0, 1.0
        return
    cube = s * s * s
    out[3] = cube * (10.0 + s * (-15.0 + 6.0 * s))
    out[0] = 1.0 - out[3]
    out[1] = remaining * (s + cube * (-6.0 + s * (8.0 - 3.0 * s)))
    out[2] = remaining * remaining * (0.5 * s * s + cube * (-1.5 + s * (1.5 - 0.5 * s)))


@njit
def update_aims(
    means: Array,
    covariances: Array,
    logs: Array,
    remaining: Array,
    time: float,
    value: Array,
    seen: Array,
    noise: Array,
    drift: float,
    gain: Array,
    rows: Array,
) -> None:
    """Condition the hypotheses of one moment (H, ...) on one observation, in place.

    ``drift`` is the variance that the ends have gained since the last one. Hypotheses that are ruled out
    (-inf) are left alone.
    """
    for h in range(logs.shape[0]):
        if logs[h] == -math.inf:
            continue
        for end in range(TERMS - 1, means.shape[1], TERMS):
            covariances[h, end, end] += drift
        hermite_row(time, remaining[h], rows[0])
        density = kalman_step(means[h], covariances[h], rows, value, seen, noise, gain)
        logs[h] += -1e3 if math.isnan(density) else density


@njit
def mix_aims(
    means: Array,
    covariances: Array,
    weights: Array,
    remaining: Array,
    time: float,
    step: float,
    first: Array,
    second: Array,
) -> None:
    """Add weighted first (K, 6) and raw second moments (K, 2, 3, 3) of the hypotheses of one moment."""
    row = np.empty(TERMS)
    for h in range(weights.shape[0]):
        if weights[h] <= 0.0:
            continue
        for k in range(first.shape[0]):
            hermite_row(time + k * step, remaining[h], row)
            for block in range(2):
                for i in range(3):
                    d = 3 * block + i
                    mean = 0.0
                    for a in range(TERMS):
                        mean += row[a] * means[h, TERMS * d + a]
                    first[k, d] += weights[h] * mean
                    for j in range(3):
                        e = 3 * block + j
                        other = 0.0
                        square = 0.0
                        for a in range(TERMS):
                            other += row[a] * means[h, TERMS * e + a]
                            for b in range(TERMS):
                                square += (
                                    row[a] * covariances[h, TERMS * d + a, TERMS * e + b] * row[b]
                                )
                        second[k, block, i, j] += weights[h] * (square + mean * other)


@dataclass(frozen=True)
class Aims:
    """Where a hand may be re-aimed to; computed once for a library and side.

    Args:
        tasks: (H,) index of the task.
        remaining: (H,) seconds that are still needed.
        covariances: (H, 24, 24) prior of position, velocity, acceleration and end of each dimension.
        ends: (H, 6) mean end, relative to the shoulder at onset.
    """

    tasks: NDArray[np.int64]
    remaining: Array
    covariances: Array
    ends: Array


def aims_of(tasks: tuple[TaskModel, ...], widening_sd: float) -> Aims:
    """One for each task and share of its duration.

    Args:
        tasks: The known tasks.
        widening_sd: Added to the spread of their ends: a re-aimed hand lands less well [m].
    """
    index, remaining, covariances, ends = [], [], [], []
    for number, task in enumerate(tasks):
        spread = task.promp.trajectory_covariance([1.0])[0] + widening_sd**2 * np.eye(DIMS)
        full = np.zeros((DIMS, TERMS, DIMS, TERMS))
        for d in range(DIMS):
            for term, sd in enumerate((_POSITION_SD, _VELOCITY_SD, _ACCELERATION_SD)):
                full[d, term, d, term] = sd**2
        full[:, 3, :, 3] = spread
        for share in REMAINING:
            index.append(number)
            remaining.append(share * task.duration_mean_s)
            covariances.append(full.reshape(DIMS * TERMS, -1))
            ends.append(task.promp.trajectory_mean([1.0])[0])
    return Aims(np.array(index), np.array(remaining), np.stack(covariances), np.stack(ends))


class ReaimBank:
    """The running belief that a reach was re-aimed, when, and whereto.

    Args:
        aims: Where to.
        change_rate: Expected number of changes of mind a second.
        noise_sd: Deviation of a sample from a hypothesis [m].
        wander: How far an end strays in a second (standard deviation) [m].
    """

    def __init__(self, aims: Aims, change_rate: float, noise_sd: float, wander: float) -> None:
        self.aims = aims
        count = len(aims.tasks)
        self._prior = math.log(max(change_rate * SPACING_S, 1e-300) / count)
        self._wander = wander
        self._noise = noise_sd**2 * np.eye(DIMS)
        self._means = np.zeros((SLOTS, count, DIMS * TERMS))
        self._covariances = np.zeros((SLOTS, count, DIMS * TERMS, DIMS * TERMS))
        self._logs = np.zeros((SLOTS, count))
        self._scratch = np.zeros(count)
        self._begun = np.zeros(SLOTS)
        self._gain = np.zeros((DIMS, DIMS * TERMS))
        self._rows = np.zeros((1, TERMS))
        self.restart()

    def restart(self) -> None:
        """A new reach begins: nothing has changed yet."""
        self._logs.fill(-math.inf)
        self._base = 0.0
        self._history: deque[tuple[float, Array, NDArray[np.bool_]]] = deque()
        self._due = -math.inf

    def observe(
        self, elapsed_s: float, value: Array, seen: NDArray[np.bool_], evidence: float
    ) -> None:
        """Condition on (elbow, wrist).

        Args:
            elapsed_s: Time since onset [s].
            value: (6,) metres, relative to the shoulder at onset.
            seen: (6,) bool.
            evidence: Log density of this observation for a reach that goes on as begun.
        """
        self._base += evidence
        passed = elapsed_s - self._history[-1][0] if self._history else 0.0
        drift = self._wander**2 * passed
        for slot in range(SLOTS):
            if self._logs[slot].max() > -math.inf:
                self._update(slot, elapsed_s, value, seen, self._logs[slot], drift)
        # Kept near 0 so that nothing is lost to rounding in long reaches.
        total = self._total()
        self._base -= total
        self._logs -= total
        # Most are soon out of the question; changes that come later are begun afresh.
        self._logs[self._logs < RULED_OUT] = -math.inf
        self._history.append((elapsed_s, value.copy(), seen.copy()))
        while elapsed_s - self._history[0][0] > SPACING_S + 1e-6:
            self._history.popleft()
        if self._due == -math.inf:
            self._due = elapsed_s + SPACING_S
        if elapsed_s >= self._due - 1e-6:
            self._due = elapsed_s + SPACING_S
            self._begin(elapsed_s)

    def _update(
        self,
        slot: int,
        now_s: float,
        value: Array,
        seen: NDArray[np.bool_],
        logs: Array,
        drift: float = 0.0,
    ) -> None:
        update_aims(
            self._means[slot],
            self._covariances[slot],
            logs,
            self.aims.remaining,
            now_s - self._begun[slot],
            value,
            seen,
            self._noise,
            drift,
            self._gain,
            self._rows,
        )

    def _begin(self, now_s: float) -> None:
        """Take the moment that matters least for a change that happens now."""
        slot = int(np.argmin(self._logs.max(axis=1)))
        self._begun[slot] = now_s
        self._means[slot] = 0.0
        self._means[slot][:, TERMS - 1 :: TERMS] = self.aims.ends
        np.copyto(self._covariances[slot], self.aims.covariances)
        # The past says where the hand is and how it moves, the same for all: no evidence.
        for time_s, value, seen in self._history:
            self._update(slot, time_s, value, seen, self._scratch)
        self._logs[slot] = self._prior

    def _total(self) -> float:
        largest = max(self._base, float(self._logs.max()))
        rest = float(np.exp(self._logs - largest).sum())
        return largest + math.log(math.exp(self._base - largest) + rest)

    def shares(self) -> tuple[float, Array]:
        """Probability that the reach goes on as begun, and of each hypothesis (SLOTS, H)."""
        total = self._total()
        return math.exp(self._base - total), np.asarray(np.exp(self._logs - total))

    def durations(self) -> Array:
        """Durations (SLOTS, H) from the onset to rest that the hypotheses make of the reach [s]."""
        return np.asarray(self._begun[:, None] + self.aims.remaining)

    def moments(
        self, weights: Array, elapsed_s: float, step_s: float, points: int
    ) -> tuple[Array, Array]:
        """Weighted first (K, 6) and raw second moments (K, 2, 3, 3) at ``elapsed_s + k step_s``."""
        first, second = np.zeros((points, DIMS)), np.zeros((points, 2, 3, 3))
        for slot in range(SLOTS):
            if weights[slot].any():
                mix_aims(
                    self._means[slot],
                    self._covariances[slot],
                    weights[slot],
                    self.aims.remaining,
                    elapsed_s - self._begun[slot],
                    step_s,
                    first,
                    second,
                )
        return first, second
