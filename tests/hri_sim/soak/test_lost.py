"""What a recorder says that it lost, from one sample of a soak to the next."""

from __future__ import annotations

from typing import Any

from hri_sim.soak.lost import Lost, lost_messages

STOOD = {"fault": "pause", "node": "recorder", "s": 10.0, "seconds": 2.0}


def _sample(second: float, **counts: float) -> dict[str, Any]:
    return {
        "s": second,
        "figures": {"recorder": counts} if counts else {"person": {"tick_hz": 250.0}},
    }


def test_nothing_is_lost() -> None:
    samples = [_sample(s, dropped=0.0, lost_in_transport=0.0) for s in range(20)]
    assert lost_messages(samples, [STOOD]) == Lost(0, 0)


def test_nobody_records() -> None:
    assert lost_messages([_sample(1.0)], []) is None


def test_what_is_lost_while_it_stands_still_is_told_apart() -> None:
    counts = {5: 0, 6: 2, 10: 2, 13: 402, 14: 402, 17: 403}
    samples = [
        _sample(s, dropped=0.0, lost_in_transport=float(count)) for s, count in counts.items()
    ]
    assert lost_messages(samples, [STOOD]) == Lost(3, 400)
    others = [{**STOOD, "node": "person"}, {**STOOD, "fault": "kill", "seconds": 0.0}]
    assert lost_messages(samples, others) == Lost(403, 0)


def test_a_recorder_that_is_started_again_begins_anew() -> None:
    samples = [
        _sample(1.0, dropped=5.0, lost_in_transport=1.0),
        _sample(2.0),  # there is none
        _sample(3.0, dropped=0.0, lost_in_transport=0.0),
        _sample(4.0, dropped=0.0, lost_in_transport=4.0),
    ]
    assert lost_messages(samples, []) == Lost(10, 0)
