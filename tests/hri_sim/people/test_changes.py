"""Reaches that stop or are diverted on their way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import PlanningError
from hri_sim.people.changes import BRAKE_S, CHANGE, Stopped, change_mind, stop_midway
from hri_sim.people.motion import HandMotion
from hri_sim.people.person import SimulatedPerson
from hri_sim.scenario.schema import PersonSpec

TARGET, OTHER = (0.40, -0.10, 0.15), (0.45, 0.20, 0.12)
MOTION = HandMotion(
    0.2, 1.2, np.zeros(3), np.array([0.3, 0.1, 0.0]), np.array([0.0, 0.0, 0.05]), (0.1, 0.3)
)


def reaching(seed=0):
    person = SimulatedPerson(PersonSpec(), seed)
    person.plan_reach(TARGET, 0.3, 1.2)
    return person


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 1.0))
def test_a_stop_is_on_the_way_smooth_and_final(share):
    stopped = Stopped(MOTION, MOTION.start_s + share * MOTION.duration)
    step = 1e-3
    time = np.arange(0.0, 2.5, step)
    tip, swivel = stopped.sample(time)
    before = time < stopped.brake_s
    np.testing.assert_array_equal(tip[before], MOTION.sample(time[before])[0])
    # Half of the braking time further along the path of the movement, as at a constant deceleration.
    rest = MOTION.sample(stopped.brake_s + 0.5 * BRAKE_S)
    np.testing.assert_allclose(stopped.end, rest[0], atol=1e-12)
    np.testing.assert_allclose(stopped.swivel, (0.1, rest[1]), atol=1e-12)
    np.testing.assert_allclose(
        tip[time >= stopped.end_s], np.broadcast_to(rest[0], (sum(time >= stopped.end_s), 3))
    )
    jump = np.abs(np.diff(np.diff(tip, 2, axis=0), axis=0)).max() / step**2
    assert jump < 0.15  # m/s^2 within a millisecond
    assert swivel.min() >= 0.1 - 1e-12


def test_people_stop_and_change_their_mind_in_the_same_part_of_a_reach():
    (motion,) = reaching().motions
    rng = np.random.default_rng(0)
    stops = [stop_midway(motion, rng).brake_s for _ in range(50)]
    changes = [change_mind(PersonSpec(), motion, OTHER, 1.0, rng).second.start_s for _ in range(50)]
    for times in (stops, changes):
        shares = (np.array(times) - motion.start_s) / motion.duration
        assert CHANGE[0] <= shares.min() < shares.max() <= CHANGE[1]


def test_a_diverted_person_goes_on_from_where_it_ends():
    person = reaching()
    (motion,) = person.motions
    changed = change_mind(person.spec, motion, OTHER, 1.0, np.random.default_rng(1))
    person.divert(changed)
    assert person.rests_from_s == changed.end_s
    assert np.linalg.norm(changed.end - OTHER) < 0.08
    later = person.plan_reach(TARGET, person.rests_from_s, 1.0)
    np.testing.assert_array_equal(later.start, changed.end)
    assert later.swivel[0] == pytest.approx(changed.swivel[1])
    near = person.truth(changed.end_s + np.array([-1e-3, 0.0, 1e-3]))
    assert np.abs(np.diff(near, 2, axis=0)).max() < 1e-6


def test_only_the_present_reach_can_be_diverted():
    with pytest.raises(PlanningError, match="planned reach"):
        SimulatedPerson(PersonSpec(), 0).divert(MOTION)
    person = reaching()
    with pytest.raises(PlanningError, match=r"0\.3 s"):
        person.divert(MOTION)
