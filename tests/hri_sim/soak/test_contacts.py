"""Contacts are found where they begin, with the speed that the robot had before they slowed it."""

from __future__ import annotations

import pytest

from hri_sim.soak.contacts import BEFORE, STANDS, Contact, ContactWatch, harmful_above


def contacts(states: list[tuple[float, float]]) -> list[Contact]:
    watch = ContactWatch()
    found = (watch.hear(clearance, speed, "hand", "ann/forearm") for clearance, speed in states)
    return [contact for contact in found if contact is not None]


def test_a_contact_is_counted_once_however_long_it_is() -> None:
    states = [(0.01, 0.0), (0.0, 0.1), (-0.01, 0.1), (-0.01, -0.2), (0.002, -0.2), (-0.001, -0.3)]
    assert [c.approach for c in contacts(states)] == [0.1, 0.1]


def test_the_speed_is_that_before_the_contact_itself_changed_it() -> None:
    coming = [(0.02 - 0.001 * i, 0.4) for i in range(19)]
    assert contacts([*coming, (-0.001, -0.6)])[0].approach == 0.4
    long_ago = [(0.02, 0.4)] + [(0.02, -0.1)] * BEFORE
    assert contacts([*long_ago, (-0.001, -0.1)])[0].approach == -0.1
    assert contacts([*long_ago, (-0.001, -0.1)])[0].robot_part == "hand"


def test_without_a_contact_speed_the_robot_is_to_stand() -> None:
    assert harmful_above(0.0) == STANDS
    assert harmful_above(0.15) == pytest.approx(0.15)
