"""Commands that wait for a tick."""

from hypothesis import given
from hypothesis import strategies as st

from hri_sim.nodes.timed_commands import TimedCommands

came = st.lists(st.tuples(st.integers(0, 50), st.integers() | st.text()), max_size=20)


@given(came, st.lists(st.integers(0, 60), max_size=6))
def test_each_is_taken_once_and_those_of_a_type_in_the_order_of_arrival(
    items: list[tuple[int, int | str]], times: list[int]
) -> None:
    """Whatever the clock said when they came."""
    commands = TimedCommands()
    for came_ns, command in items:
        commands.add(came_ns, command)
    taken = [item for time_ns in sorted(times) for item in commands.take(time_ns)]
    taken += commands.take()
    assert not commands.take()
    assert [came_ns for came_ns, _ in taken] == sorted(came_ns for came_ns, _ in taken)
    for kind in (int, str):
        assert [one for _, one in taken if isinstance(one, kind)] == [
            one for _, one in items if isinstance(one, kind)
        ]


def test_what_came_before_a_time_is_taken() -> None:
    commands = TimedCommands()
    for came_ns, command in ((3, "c"), (1, 1), (4, "d"), (2, 2)):
        commands.add(came_ns, command)
    assert commands.take(3) == [(1, 1), (2, 2)]
    assert commands.take(4) == [(3, "c")]
    assert commands.take(4) == []
    assert commands.take() == [(4, "d")]
    commands.add(5, "e")
    commands.clear()
    assert commands.take() == []
