"""Memory that a process keeps of its first standstill is no growth; all else is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hri_sim.soak.memory import BESIDE_S, first_standstill, kept, memory_rows

PAUSES = tuple(
    {"s": s, "fault": "pause", "node": "recorder", "seconds": 1.6} for s in (80.0, 110.0, 140.0)
)
OTHERS = (
    {"s": 50.0, "fault": "pause", "node": "predictor", "seconds": 1.0},
    {"s": 55.0, "fault": "kill", "node": "recorder", "seconds": 0.0},
)


def samples(memory: np.ndarray) -> list[dict[str, Any]]:
    """One process, a sample a second."""
    figures = {
        "born": 0.0, "resident_mb": 140.0, "threads": 12, "files": 14, "cpu_s": 0.0,
    }  # fmt: skip
    return [
        {"s": float(s), "processes": {"recorder": {**figures, "memory_mb": float(mb)}}}
        for s, mb in enumerate(memory)
    ]


def steps(*, at: float, each: float) -> np.ndarray:
    """70 MB; 6 more from the first pause on, ``each`` more from the others on, from ``at`` s after them."""
    times = np.arange(180.0)
    memory = np.full(180, 70.0)
    for pause, more in zip(PAUSES, (6.0, each, each), strict=True):
        memory += more * (times > pause["s"] + at)
    return memory


def test_what_is_kept_of_the_first_standstill_is_no_growth() -> None:
    (row,) = memory_rows(samples(steps(at=0.0, each=0.0)), (*OTHERS, *PAUSES))
    assert row["kept_mb"] == pytest.approx(6.0)
    assert row["growth"]["share"] == pytest.approx(0.0, abs=1e-9)
    assert row["growth"]["first"] == row["growth"]["last"] == pytest.approx(70.0)


def test_what_is_kept_of_each_standstill_is_growth() -> None:
    (row,) = memory_rows(samples(steps(at=0.0, each=3.0)), PAUSES)
    assert row["kept_mb"] == pytest.approx(6.0)
    assert row["growth"]["share"] >= 6.0 / 70.0


@pytest.mark.parametrize("faults", [(), OTHERS], ids=["none", "of others"])
def test_a_step_without_a_standstill_is_growth(faults: tuple[dict[str, Any], ...]) -> None:
    (row,) = memory_rows(samples(steps(at=0.0, each=0.0)), faults)
    assert row["kept_mb"] == 0.0
    assert row["growth"]["share"] == pytest.approx(6.0 / 70.0, rel=0.01)


def test_a_leak_that_goes_on_is_growth_beside_what_is_kept() -> None:
    leak = 70.0 * 0.08 * np.arange(180.0) / 150.0
    (row,) = memory_rows(samples(steps(at=0.0, each=0.0) + leak), PAUSES)
    # Of the leak, what comes while the standstill is looked at counts as kept: it is some 7 s of 150.
    assert 0.07 < row["growth"]["share"] < 0.081


def test_what_shrinks_at_a_standstill_hides_nothing() -> None:
    memory = 70.0 - 6.0 * (np.arange(180.0) > PAUSES[0]["s"]) + 12.0 * (np.arange(180.0) > 120.0)
    (row,) = memory_rows(samples(memory), PAUSES)
    assert row["kept_mb"] == 0.0
    assert row["growth"]["share"] == pytest.approx(6.0 / 70.0, rel=0.01)


def test_the_first_standstill_is_that_of_this_life_of_this_process() -> None:
    faults = (*OTHERS, *reversed(PAUSES))
    assert first_standstill(faults, "recorder", 0.0, 180.0) == (80.0, pytest.approx(81.6))
    assert first_standstill(faults, "recorder", 90.0, 180.0) == (110.0, pytest.approx(111.6))
    assert first_standstill(faults, "recorder", 145.0, 180.0) is None
    assert first_standstill(faults, "person", 0.0, 180.0) is None


def test_nothing_is_kept_where_there_is_nothing_to_compare() -> None:
    times = np.arange(30.0, 60.0)
    memory = np.linspace(70.0, 80.0, 30)
    assert kept(times, memory, 30.0 - 1.0, 31.0) == 0.0
    assert kept(times, memory, 58.0, 59.6) == 0.0
    assert kept(times, memory, 40.0, 41.0 + BESIDE_S) > 0.0
