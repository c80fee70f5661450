"""Rates, ages and latencies of topics, from stamps and counters alone."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.flow import COMPARABLE_NS, KEPT, NANO, WINDOW_NS, Flow, Rates

NOW = 1_700_000_000 * NANO


@given(
    st.lists(st.integers(-NANO, NANO), min_size=1, max_size=40),
    st.integers(1, 60),
    st.integers(0, 3),
)
def test_latency_is_of_the_newest_messages(delays: list[int], newest: int, rounds: int) -> None:
    # Rounds: the buffer has been filled before, and is written over.
    flow = Flow(delays=True)
    for delay in [5 * NANO] * (rounds * KEPT - 7) + delays:
        flow.note(NOW, NOW - delay)
    kept = sorted(([5 * NANO] * (rounds * KEPT - 7) + delays)[-newest:])
    middle, high = kept[len(kept) // 2], kept[int(len(kept) * 0.99)]
    assert flow.latency_ms(newest) == pytest.approx((middle / 1e6, high / 1e6))


def test_no_more_than_what_is_kept_counts() -> None:
    flow = Flow(delays=True)
    for delay_ms in range(2 * KEPT):
        flow.note(NOW, NOW - delay_ms * 1_000_000)
    found = flow.latency_ms(10 * KEPT)
    assert found is not None
    assert found[0] == pytest.approx(np.median(np.arange(KEPT, 2 * KEPT)), abs=1.0)


def test_age_is_that_of_the_stamp_or_of_the_receipt() -> None:
    flow = Flow(delays=True)
    assert flow.age_s(NOW) is None
    assert flow.quiet_s(NOW) == 0.0
    assert flow.latency_ms(1) is None
    flow.note(NOW, NOW - NANO // 4)
    assert flow.age_s(NOW + NANO) == pytest.approx(1.25)
    assert flow.quiet_s(NOW + NANO) == pytest.approx(1.0)
    flow.note(NOW, 0)
    assert flow.age_s(NOW + NANO) == pytest.approx(1.0)
    # A stamp ahead of the clock is one: truth that is sent before its time.
    flow.note(NOW, NOW + NANO)
    assert flow.age_s(NOW) == pytest.approx(-1.0)


@pytest.mark.parametrize("delay_ns", [2 * COMPARABLE_NS, -2 * COMPARABLE_NS, NOW - NANO])
def test_stamps_of_another_clock_have_no_latency(delay_ns: int) -> None:
    flow = Flow(delays=True)
    flow.note(NOW, NOW - delay_ns)
    assert flow.latency_ms(1) is None


def test_commands_and_latched_topics_have_no_latency() -> None:
    flow = Flow(delays=False)
    flow.note(NOW - NANO, NOW - 9 * NANO)
    assert flow.latency_ms(1) is None
    assert flow.age_s(NOW) == pytest.approx(1.0)  # since the receipt: the stamp does not say it


@given(st.integers(0, 400), st.integers(2, 12))
def test_a_steady_counter_has_its_rate(per_look: int, looks: int) -> None:
    rates = Rates()
    for index in range(looks):
        found = rates.look(NOW + index * NANO, {"a": index * per_look})
    assert found["a"].hz == pytest.approx(per_look)
    assert found["a"].seconds <= WINDOW_NS / NANO


def test_what_is_over_counts_until_the_window_has_passed() -> None:
    rates = Rates()
    found = [rates.look(NOW + i * NANO, {"a": min(i, 3) * 100}).get("a") for i in range(10)]
    assert found[0] is None
    assert [item.hz for item in found[1:] if item] == pytest.approx(
        [100, 100, 100, 75, 60, 40, 20, 0, 0]
    )


def test_counters_that_come_or_begin_anew() -> None:
    rates = Rates()
    rates.look(NOW, {"a": 50})
    rates.look(NOW + NANO, {"a": 60, "b": 5})
    found = rates.look(NOW + 2 * NANO, {"a": 8, "b": 25})  # a topic was left, and taken up again
    assert "a" not in found
    assert found["b"].hz == pytest.approx(20.0)
    assert rates.look(NOW + 3 * NANO, {"a": 18})["a"].hz == pytest.approx(10.0)
    assert rates.look(NOW, {"a": 30}) == {}  # the clock went back
    assert rates.look(NOW + NANO, {"a": 40})["a"].hz == pytest.approx(10.0)


def test_a_long_pause_between_two_looks_is_averaged() -> None:
    rates = Rates()
    rates.look(NOW, {"a": 0})
    assert rates.look(NOW + 60 * NANO, {"a": 600})["a"].hz == pytest.approx(10.0)
