"""What grows is found, what only wavers is not."""

from __future__ import annotations

import numpy as np
import pytest

from hri_sim.soak.growth import latency_growth, memory_growth


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


def test_a_leak_is_measured(rng: np.random.Generator) -> None:
    time_s = np.arange(3600.0)
    leak = 100.0 * (1.0 + 0.08 * time_s / 3600.0) + rng.normal(0.0, 0.5, len(time_s))
    found = memory_growth(time_s, leak)
    assert found.share == pytest.approx(0.08, abs=0.004)
    assert found.low < found.high
    assert found.low == pytest.approx(0.08, abs=0.004)
    assert found.span_s == 3599.0


def test_peaks_are_no_growth_but_a_step_is(rng: np.random.Generator) -> None:
    time_s = np.arange(600.0)
    flat = 100.0 + rng.normal(0.0, 0.2, len(time_s))
    peaks = flat.copy()
    peaks[::50] += 40.0
    assert abs(memory_growth(time_s, peaks).share) < 0.005
    step = flat + np.where(time_s > 420.0, 10.0, 0.0)
    assert memory_growth(time_s, step).share >= 0.095
    shrinks = memory_growth(time_s, flat - 0.02 * time_s)
    assert shrinks.high < 0.0


def test_latency_of_first_and_last_third(rng: np.random.Generator) -> None:
    time_s = np.sort(rng.uniform(0.0, 600.0, 9000))
    calm = 35.0 + rng.gamma(2.0, 3.0, len(time_s))
    found = latency_growth(time_s, calm, rng)
    assert found is not None
    assert found.low < 0.0 < found.high
    grown = latency_growth(time_s, calm * (1.0 + 0.2 * time_s / 600.0), rng)
    assert grown is not None
    assert grown.low > 0.08
    assert grown.share == pytest.approx(0.13, abs=0.03)


def test_too_few_latencies_say_nothing(rng: np.random.Generator) -> None:
    assert latency_growth(np.zeros(0), np.zeros(0), rng) is None
    time_s = np.linspace(0.0, 30.0, 300)
    assert latency_growth(time_s, np.ones(300), rng) is None
