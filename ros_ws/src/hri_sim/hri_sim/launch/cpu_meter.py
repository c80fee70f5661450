"""How much of the machine the processes of a run keep busy, and how much of it its host takes away."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence

import psutil


class CpuMeter:
    """CPU time of some processes against the clock, from its making on."""

    def __init__(self, pids: Sequence[int]) -> None:
        self._processes = [psutil.Process(pid) for pid in pids]
        self._begun = time.monotonic()
        self._spent = self._cpu_s()
        self._of_machine = psutil.cpu_times()

    def _cpu_s(self) -> float:
        total = 0.0
        for process in self._processes:
            with contextlib.suppress(psutil.NoSuchProcess):
                times = process.cpu_times()
                total += times.user + times.system
        return total

    def cores(self) -> float:
        """Mean number of cores kept busy."""
        return (self._cpu_s() - self._spent) / max(time.monotonic() - self._begun, 1e-9)

    def host_share(self) -> float:
        """Share of this machine's processor time in which it wanted to run, but its host ran others.

        Linux calls it steal (proc_stat(5)). 0 where the machine is not a virtual one, and where the
        system does not tell.
        """
        before, after = self._of_machine._asdict(), psutil.cpu_times()._asdict()
        # Guests' time is within user's and nice's.
        spent = {name: after[name] - before[name] for name in after if not name.startswith("guest")}
        return max(spent.get("steal", 0.0), 0.0) / max(sum(spent.values()), 1e-9)
