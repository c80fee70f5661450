"""95 % intervals that respect that conditions of a task are alike: tasks are drawn, not motions.

All take sums and numbers of values by task (tasks, 2).
"""

from __future__ import annotations

import numpy as np
from scipy import stats

from hri_prediction.arm.geometry import FloatArray

RESAMPLES = 2000
FEWEST_TASKS = 5
"""Of fewer a bootstrap only says the range."""
_BOOTSTRAP_SEED = 0
_TAIL = 0.025


def mean_of(sums: FloatArray) -> float | None:
    """The mean from sums and numbers (tasks, 2); none when there are no values."""
    total, count = sums.sum(axis=0)
    return float(total / count) if count else None


def mean_interval(sums: FloatArray) -> list[float] | None:
    """Interval of a mean by a bootstrap of whole tasks; none of fewer than five tasks with values.

    Tasks are drawn with replacement (2000 times), each with all its conditions and seeds: these
    have person and places in common and are no independent trials. Percentiles are expanded for
    the number of tasks, as Student's t is wider than the normal distribution (Hesterberg 2015,
    "What Teachers Should Know About the Bootstrap", section 5.1).
    """
    sums = sums[sums[:, 1] > 0.0]
    tasks = len(sums)
    if tasks < FEWEST_TASKS:
        return None
    chosen = np.random.default_rng(_BOOTSTRAP_SEED).integers(tasks, size=(RESAMPLES, tasks))
    total = sums[chosen].sum(axis=1)
    widening = np.sqrt(tasks / (tasks - 1.0))
    tail = 100.0 * float(stats.norm.cdf(widening * stats.t.ppf(_TAIL, tasks - 1)))
    low, high = np.percentile(total[:, 0] / total[:, 1], [tail, 100.0 - tail])
    return [float(low), float(high)]


def share_interval(sums: FloatArray) -> list[float]:
    """Interval of a share, from successes and trials by task (Korn and Graubard 1998).

    Clopper and Pearson's, for as many independent trials as would vary as much as the tasks do. Where all
    or none succeed nothing varies: then there are as many trials as tasks. Of fewer than two tasks nothing
    is known: 0 to 1.
    """
    sums = sums[sums[:, 1] > 0.0]
    tasks, share = len(sums), mean_of(sums)
    if tasks < 2 or share is None:
        return [0.0, 1.0]
    trials = float(tasks)
    if 0.0 < share < 1.0:
        spread = tasks / (tasks - 1.0) * float((_residuals(sums, share) ** 2).sum())
        independent = share * (1.0 - share) / spread if spread > 0.0 else np.inf
        narrowing = (stats.norm.ppf(_TAIL) / stats.t.ppf(_TAIL, tasks - 1)) ** 2
        trials = max(min(independent, float(sums[:, 1].sum())) * narrowing, 1.0)
    good, bad = share * trials, (1.0 - share) * trials
    low = float(stats.beta.ppf(_TAIL, good, bad + 1.0)) if good > 0.0 else 0.0
    high = float(stats.beta.ppf(1.0 - _TAIL, good + 1.0, bad)) if bad > 0.0 else 1.0
    return [min(low, share), max(high, share)]


def share_difference_interval(sums: FloatArray, less: FloatArray) -> list[float]:
    """Interval of a difference of shares in the same tasks.

    From both shares' own intervals and the correlation of tasks, what makes one hard for both being no
    difference (Newcombe 1998, "Improved confidence intervals for the difference between binomial
    proportions based on paired data", with the correlation of tasks).

    Args:
        sums: Successes and trials by task (tasks, 2).
        less: The same of what is subtracted, of the same tasks.
    """
    share, other = mean_of(sums) or 0.0, mean_of(less) or 0.0
    (low, high), (other_low, other_high) = share_interval(sums), share_interval(less)
    ours, theirs = _residuals(sums, share), _residuals(less, other)
    size = float(np.sqrt((ours**2).sum() * (theirs**2).sum()))
    together = float(ours @ theirs) / size if size > 0.0 else 0.0
    down = _combined(share - low, other_high - other, together)
    up = _combined(high - share, other - other_low, together)
    return [share - other - down, share - other + up]


def _residuals(sums: FloatArray, share: float) -> FloatArray:
    """What each task adds to the error of the share (tasks,)."""
    return np.asarray((sums[:, 0] - share * sums[:, 1]) / sums[:, 1].sum(), dtype=float)


def _combined(ours: float, theirs: float, correlation: float) -> float:
    """Half-width of a difference from the half-widths of its parts."""
    square = ours**2 - 2.0 * correlation * ours * theirs + theirs**2
    return float(np.sqrt(max(square, 0.0)))
