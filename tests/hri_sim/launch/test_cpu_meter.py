"""What a run took of the machine, and what the machine's host took."""

from __future__ import annotations

import os
import time
from types import SimpleNamespace

import pytest

from hri_sim.launch import cpu_meter
from hri_sim.launch.cpu_meter import CpuMeter


class _Times(SimpleNamespace):
    def _asdict(self) -> dict[str, float]:
        return vars(self)


def test_what_a_process_spends() -> None:
    meter = CpuMeter([os.getpid()])
    until = time.process_time() + 0.3
    while time.process_time() < until:
        pass
    assert 0.0 < meter.cores() < 2.0


@pytest.mark.parametrize(
    ("after", "share"),
    [
        # Guests' time is within user's: 100 s in all, 8 of them taken.
        (_Times(user=60.0, system=20.0, idle=30.0, steal=8.0, guest=40.0, guest_nice=5.0), 0.08),
        (_Times(user=10.0, system=10.0, idle=10.0, steal=0.0, guest=0.0, guest_nice=0.0), 0.0),
    ],
)
def test_what_the_host_takes(monkeypatch: pytest.MonkeyPatch, after: _Times, share: float) -> None:
    before = _Times(user=9.0, system=5.0, idle=4.0, steal=0.0, guest=0.0, guest_nice=0.0)
    times = iter([before, after])
    monkeypatch.setattr(cpu_meter.psutil, "cpu_times", lambda: next(times))
    assert CpuMeter([]).host_share() == pytest.approx(share)


def test_a_system_that_does_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter([_Times(user=1.0, idle=1.0), _Times(user=2.0, idle=5.0)])
    monkeypatch.setattr(cpu_meter.psutil, "cpu_times", lambda: next(times))
    assert CpuMeter([]).host_share() == 0.0
