"""Contacts are judged from begin to end, by how fast the robot came at the person of its own."""

from __future__ import annotations

import pytest

from hri_sim.launch.separation import CONTACT_SPEED, contact_speed
from hri_sim.soak.contacts import STANDS, Contact, ContactWatch, harmful_above

PAIR = ("hand", "ann/forearm")
STEP_S = 0.004


def contacts(
    states: list[tuple[float, float]], *, moving: bool = True, pair: tuple[str, str] = PAIR
) -> list[Contact]:
    watch = ContactWatch()
    for row, (clearance, approach) in enumerate(states):
        if moving:
            watch.reference(row * STEP_S, 0.5)
        watch.state(row * STEP_S, clearance, approach, *pair)
    watch.close()
    return watch.contacts


def test_a_contact_is_one_from_begin_to_end() -> None:
    touching = [(-0.001, 0.05)] * 10 + [(0.001, 0.05)] * 5 + [(-0.002, 0.05)] * 10
    (one,) = contacts([(0.01, 0.05)] * 10 + touching)
    assert one.s == pytest.approx(0.04)
    assert one.seconds == pytest.approx(0.096)
    two = contacts(touching + [(0.02, 0.0)] * 50 + touching)
    assert len(two) == 2


def test_a_robot_that_drives_into_whom_it_touches_already_is_seen() -> None:
    (found,) = contacts([(-0.001, 0.0)] * 100 + [(-0.005, 1.0)] * 20 + [(-0.01, 0.0)] * 100)
    assert found.approach == 1.0


def test_the_speed_before_the_contact_changed_it_counts_of_the_same_parts() -> None:
    coming = [(0.02 - 0.001 * i, 0.4) for i in range(19)]
    assert contacts([*coming, (-0.001, -0.6)])[0].approach == 0.4
    long_ago = [(0.02, 0.4)] + [(0.02, -0.1)] * 10
    assert contacts([*long_ago, (-0.001, -0.1)])[0].approach == -0.1
    watch = ContactWatch()
    watch.reference(0.0, 0.5)
    watch.state(0.0, 0.01, 0.9, "upper_arm", "ann/hand")
    watch.state(0.004, -0.01, 0.1, *PAIR)
    watch.close()
    assert watch.contacts[0].approach == 0.1
    assert watch.contacts[0].human_part == "ann/forearm"


def test_a_robot_at_rest_that_swings_back_does_not_come_at_anybody() -> None:
    (found,) = contacts([(-0.001, 0.3)] * 100, moving=False)
    assert found.approach == 0.0
    watch = ContactWatch()
    watch.reference(0.0, 0.5)
    for row in range(100):  # it moved until shortly before
        watch.state(row * STEP_S, -0.001, 0.3 if row > 90 else 0.1, *PAIR)
    watch.close()
    assert watch.contacts[0].approach == 0.1


def test_a_simulation_that_begins_anew_has_no_past() -> None:
    watch = ContactWatch()
    watch.reference(10.0, 0.5)
    watch.state(10.0, -0.001, 0.3, *PAIR)
    watch.state(0.0, -0.001, 0.5, *PAIR)
    watch.close()
    assert [contact.approach for contact in watch.contacts] == [0.3, 0.0]


def test_what_is_allowed_is_what_the_monitor_was_told() -> None:
    assert harmful_above(0.0) == STANDS
    assert harmful_above(0.15) == 0.15
    speeds = {mode: contact_speed(mode) for mode in ("off", "assumed", "measured", "predicted")}
    assert speeds == {
        "off": 0.0, "assumed": 0.0, "measured": CONTACT_SPEED, "predicted": CONTACT_SPEED,
    }  # fmt: skip
