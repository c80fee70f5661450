"""What is said of times that were measured beside the process that learns."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from hri_sim.hybrid.latency import Timed, _ran_ns, latency


def test_runs_are_put_together_and_those_beside_work_told_apart() -> None:
    first = Timed(np.array([1.0, 2.0, 3.0]), np.array([False, True, False]), learnt=2)
    second = Timed(np.array([9.0]), np.array([True]), learnt=1, explained=4)
    both = latency([first, second])
    assert (both.p50, both.most, both.count, both.learnt, both.explained) == (2.5, 9.0, 4, 3, 4)
    busy = latency([first, second], at_work=True)
    assert (busy.p50, busy.most, busy.count) == (5.5, 9.0, 2)


def test_there_may_be_none_beside_work() -> None:
    found = latency([Timed(np.array([1.0]), np.array([False]))], at_work=True)
    assert found.count == 0
    assert np.isnan(found.p50)


def test_a_process_at_work_is_seen() -> None:
    before = _ran_ns(os.getpid())
    end = time.process_time() + 0.05
    while time.process_time() < end:
        pass
    assert _ran_ns(os.getpid()) - before == pytest.approx(5e7, rel=0.9)
    assert _ran_ns(2**22) == 0
