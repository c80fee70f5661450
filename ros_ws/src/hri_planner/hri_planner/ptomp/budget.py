"""Virtual time: how many iterations fit into an interval on a machine of known speed.

Measured time differs from run to run; a frozen cost model makes lock-step runs and benchmarks
reproducible to the bit. One iteration costs F * (15 us + 0.30 us * NT * (L + 3)), where L is the
number of free time steps and F says how many times slower than the reference machine this one is.
What a replan does besides iterating (predicting, gathering other motions) can be charged too.
"""

from __future__ import annotations

BASE_S = 15e-6
PER_POINT_S = 0.30e-6
EXTRA_POINTS = 3


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

    def iterations(self, interval_s: float, rollouts: int, free_steps: int) -> int:
        """Number of iterations that fit now when nothing else is charged; see :meth:`grant`."""
        return self.grant(interval_s, rollouts, free_steps) or 0
