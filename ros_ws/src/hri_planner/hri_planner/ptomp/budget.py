"""Virtual time: how many iterations fit into an interval on a machine of known speed.

Measured time differs from run to run; a frozen cost model makes lock-step runs and benchmarks
reproducible to the bit. One iteration costs F * (15 us + 0.30 us * NT * (L + 3)), where L is the
number of free time steps and F says how many times slower than the reference machine this one is.
What a replan does besides iterating (predicting, gathering other motions) is charged too.
"""

from __future__ import annotations

from hri_planner.ptomp.config import PtompConfig

BASE_S = 15e-6
PER_POINT_S = 0.30e-6
EXTRA_POINTS = 3
# What a replan costs besides its iterations, on the reference machine: rounded from measurements of
# November 2026 (tenth percentiles of 600 replans on a shared core, where an iteration with NT = 30 and
# TS = 42 took 0.4 to 0.5 ms; the cost model says 0.42) and frozen like it. A benchmark of next year is to
# be comparable, though the code may have become faster. `GATHER_S` is the price when the plan meets the
# person, charged always; it is a tenth of that when it does not.
PREDICTION_S = 0.5e-3
"""Charged at each replan for the samples of an interval and one forecast [s]."""
GATHER_S = 2.5e-3
"""Charged at each replan for other motions compared (slower, stopped, around, back), if any are [s]."""
POSTURE_S = 0.045e-3
"""Charged at each replan for each final posture that is looked for [s]."""
START_S = 5e-3
"""Charged once, for the first final posture and the motion to it, with which the robot sets off [s]."""

ADAPTATION_S = 4e-3
"""Charged once, besides the start, where a model chooses time steps and roll-outs: the situation is looked
at, the model asked, a planner of that size made, which takes over the motion that was started [s]."""


def replan_charge(config: PtompConfig) -> float:
    """What a replan of a planner costs besides iterations, on the reference machine [s]."""
    gathers = config.time_scaling or config.ways_around
    return PREDICTION_S + gathers * GATHER_S + POSTURE_S * config.posture_candidates


class VirtualTimeBudget:
    """Iterations per interval, with what is left over carried to the next one.

    Args:
        slowdown: F; 1 is the reference machine.
    """

    def __init__(self, slowdown: float = 1.0) -> None:
        self._slowdown = slowdown
        self._left_s = 0.0

    def grant(
        self, interval_s: float, rollouts: int, free_steps: int, fixed_s: float = 0.0
    ) -> int | None:
        """Number of iterations of a replan now; none while what is saved up pays for no replan.

        Args:
            interval_s: Time that has become available [s].
            rollouts: Trajectories an iteration, NT.
            free_steps: Time steps still to be optimised, L.
            fixed_s: What a replan costs without any iteration, on the reference machine [s].
        """
        cost_s = self._slowdown * (BASE_S + PER_POINT_S * rollouts * (free_steps + EXTRA_POINTS))
        self._left_s += interval_s
        after_s = self._left_s - self._slowdown * fixed_s
        if after_s < 0.0:
            return None
        count = int(after_s / cost_s)
        self._left_s = after_s - count * cost_s
        return count
