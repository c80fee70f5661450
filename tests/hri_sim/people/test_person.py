"""Movements of the simulated person."""

import numpy as np
import pytest

from hri_prediction.errors import PlanningError
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_sim.people.person import SimulatedPerson, nominal_motion_of
from hri_sim.scenario.schema import PersonSpec

SPEC = PersonSpec()
FIRST, SECOND = (0.40, -0.10, 0.15), (0.45, 0.20, 0.12)


def make_person(seed=0, **values):
    person = SimulatedPerson(PersonSpec(**values), seed)
    person.plan_reach(FIRST, 0.5, 1.2)
    person.plan_reach(SECOND, person.rests_from_s, 1.0)
    return person


def test_minimum_jerk_is_clamped_and_symmetric():
    np.testing.assert_allclose(minimum_jerk([-1.0, 0.0, 0.5, 1.0, 2.0]), [0, 0, 0.5, 1, 1])


@pytest.mark.parametrize("side", ["left", "right"])
def test_nominal_person_goes_exactly_from_place_to_place(side):
    person = make_person(variability=0.0, side=side)
    first, second = person.motions
    assert (first.end_s, second.start_s) == pytest.approx((1.7, 1.7))
    np.testing.assert_allclose(person.truth(-10.0)[3], SPEC.home)
    np.testing.assert_allclose(person.truth(1.7)[3], FIRST)
    np.testing.assert_allclose(person.truth(99.0)[3], SECOND)


def test_truth_is_smooth_also_between_reaches():
    person = make_person(seed=3)
    step = 1e-3
    time = np.arange(0.0, 4.0, step)
    speed = np.diff(person.truth(time), axis=0) / step
    acceleration = np.diff(speed, axis=0) / step
    assert np.abs(speed).max() < 2.0
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.5  # no jump of the acceleration
    at_joint = np.searchsorted(time, person.motions[1].start_s)
    assert np.abs(speed[at_joint]).max() < 1e-2


def test_truth_of_many_times_is_the_truth_of_each():
    person = make_person()
    times = np.linspace(-1.0, 5.0, 12).reshape(3, 4)
    many = person.truth(times)
    np.testing.assert_array_equal(many[2, 1], person.truth(times[2, 1]))


def test_same_seed_same_person():
    times = np.linspace(0.0, 4.0, 50)
    np.testing.assert_array_equal(make_person(4).truth(times), make_person(4).truth(times))
    assert np.abs(make_person(4).truth(times) - make_person(5).truth(times)).max() > 1e-3


def test_end_points_scatter_by_millimetres_and_more_when_hasty():
    def scatter(duration):
        rng = np.random.default_rng(0)
        ends = []
        for _ in range(300):
            person = SimulatedPerson(SPEC, 0)
            ends.append(person.plan_reach(FIRST, 0.0, duration, rng).end)
        return np.std(np.array(ends), axis=0).mean()

    assert 0.002 < scatter(1.3) < 0.010
    assert scatter(0.65) == pytest.approx(2.0 * scatter(1.3), rel=0.05)


def test_path_is_lifted_and_slower_people_take_longer():
    person = make_person(variability=0.0, speed_factor=0.5)
    motion = person.motions[0]
    assert motion.duration == pytest.approx(2.4)
    middle = person.truth(0.5 + 1.2)[3]
    straight = 0.5 * (np.array(SPEC.home) + FIRST)
    length = np.linalg.norm(np.subtract(FIRST, SPEC.home))
    np.testing.assert_allclose(middle - straight, [0.0, 0.0, SPEC.lift * length], atol=1e-9)


def test_motion_stays_within_reach_at_full_stretch():
    spec = PersonSpec(variability=3.0)
    _, high = spec.arm.reach
    edge = np.array(spec.shoulder) + 0.999 * high * np.array([-0.9, 0.1, -0.4243])
    for seed in range(30):
        person = SimulatedPerson(spec, seed)
        person.plan_reach(edge, 0.0, 1.0)
        tips = person.truth(np.linspace(0.0, 1.5, 100))[:, 3]
        distance = np.linalg.norm(tips - spec.shoulder, axis=1)
        assert distance.max() <= high + 1e-9


@pytest.mark.parametrize(
    ("target", "start", "duration", "match"),
    [
        ((0.0, 0.0, 0.0), 5.0, 1.0, "from the shoulder"),
        ((0.4, 0.0), 5.0, 1.0, "three finite"),
        (FIRST, 5.0, 0.0, "duration"),
        (FIRST, 1.0, 1.0, "present reach ends"),
    ],
)
def test_impossible_reaches_are_refused(target, start, duration, match):
    with pytest.raises(PlanningError, match=match):
        make_person().plan_reach(target, start, duration)


def test_nominal_motion_has_no_variability():
    person = nominal_motion_of(SPEC, FIRST, SECOND, 0.2, 1.1)
    np.testing.assert_allclose(person.truth(0.2)[3], FIRST)
    np.testing.assert_allclose(person.truth(1.3)[3], SECOND)


def test_a_hand_goes_back_to_where_it_came_from():
    person = SimulatedPerson(PersonSpec(variability=0.0), 0)
    np.testing.assert_array_equal(person.came_from, SPEC.home)
    person.plan_reach(FIRST, 0.5, 1.2)
    np.testing.assert_allclose(person.came_from, SPEC.home)
    person.plan_reach(person.came_from, person.rests_from_s, 1.0)
    np.testing.assert_allclose(person.truth(99.0)[3], SPEC.home)
    # Nobody was anywhere before the first reach: that is a movement to where the hand is.
    new = SimulatedPerson(PersonSpec(), 0)
    new.plan_reach(new.came_from, 0.0, 1.0)
    np.testing.assert_allclose(new.truth([0.0, 0.5, 99.0])[:, 3], [SPEC.home] * 3, atol=1e-9)
