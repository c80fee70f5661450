"""How much of the machine the processes of a run keep busy."""

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
