"""The speed scale that the controller goes by, whoever sends it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from hri_sim.simulator.stopchain import NO_HEARTBEAT, StopChain, StopChainConfig

TIMEOUT_MS = 32
MS = 1_000_000


def chain(timeout_ms: int = TIMEOUT_MS) -> StopChain:
    return StopChain(StopChainConfig(command_timeout=0.1, heartbeat_timeout=1e-3 * timeout_ms))


def test_a_second_sender_takes_nothing_from_a_monitor() -> None:
    made = chain()
    for ms in range(0, 400, 4):
        made.command(0.0 if ms % 8 else 1.0, ms * MS)
        scale = made.update(ms * MS, 0.004, moving=True)
    assert scale == 0.0
    assert made.reason == "speed scale is 0"


def test_what_is_released_counts_a_timeout_later() -> None:
    made = chain()
    made.command(0.25, 0)
    for ms in range(8, 80, 8):
        made.command(1.0, ms * MS)
        wanted = 0.25 if ms < TIMEOUT_MS else 1.0
        assert made.update(ms * MS, 0.008, moving=False) == wanted, ms
    made.command(0.5, 81 * MS)
    assert made.update(81 * MS, 0.001, moving=False) == 0.5  # less counts at once


def test_silence_stops_the_robot_whatever_was_said() -> None:
    made = chain()
    made.command(1.0, 0)
    assert made.update(TIMEOUT_MS * MS, 0.001, moving=False) == 1.0
    assert made.update(TIMEOUT_MS * MS + 1, 0.001, moving=False) == 0.0
    assert made.reason == NO_HEARTBEAT


def test_a_plain_controller_goes_by_the_last_word() -> None:
    made = StopChain(StopChainConfig())
    made.command(0.25, 0)
    made.command(0.75, 1)
    assert made.update(2, 0.001, moving=False) == 0.75


def test_a_clock_that_goes_back_leaves_nothing_of_the_time_before() -> None:
    made = chain()
    made.command(0.0, 10_000 * MS)
    made.command(0.5, 5_000 * MS)
    assert made.update(5_001 * MS, 0.001, moving=False) == 0.5


@given(
    st.lists(st.tuples(st.integers(0, 12), st.sampled_from([0.0, 0.2, 0.5, 0.9, 1.0])), min_size=1)
)
def test_it_is_the_least_of_the_window(said: list[tuple[int, float]]) -> None:
    made, now, heard = chain(), 0, []
    for later, scale in said:
        now += later
        heard.append((now, scale))
        made.command(scale, now * MS)
        within = [value for ms, value in heard if now - ms < TIMEOUT_MS]
        assert made.update(now * MS, 0.001, moving=False) == min(within)


@given(
    st.lists(
        st.tuples(st.integers(0, 12), st.sampled_from([0.0, 0.2, 1.0]), st.integers(0, 40)),
        min_size=1,
    )
)
def test_time_that_is_left_out_counts(said: list[tuple[int, float, int]]) -> None:
    """A chain whose clock leaves times out says what one says whose clock goes on."""
    whole, leaving, now, left = chain(), chain(), 0, 0
    whole.plan_received(0, needs_replan=True)
    leaving.plan_received(0, needs_replan=True)
    for later, scale, out in said:
        now += later + out
        left += out
        leaving.leave_out(out * MS)
        assert whole.update(now * MS, 0.0, moving=False) == leaving.update(
            (now - left) * MS, 0.0, moving=False
        )
        assert whole.reason == leaving.reason
        whole.command(scale, now * MS)
        leaving.command(scale, (now - left) * MS)
