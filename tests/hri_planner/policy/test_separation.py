"""The separation is kept, whatever a bounded partner does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize

from hri_planner.policy.bounds import nearest_allowed
from hri_planner.policy.partner import Partner
from hri_planner.policy.separation import (
    NOWHERE,
    Places,
    SeparationConfig,
    keep_separation,
    keep_separations,
    together,
)
from hri_prediction.errors import ConfigError

CONFIG = SeparationConfig()
DT = 0.004
ORIGIN, AT_REST = np.zeros(3), np.zeros(3)


def place(position, velocity=AT_REST, age: float = 0.0) -> Places:
    return Places(np.array(position)[None], np.array(velocity)[None], np.array([age]))


def encounter(rng: np.random.Generator, steps: int, kind: str) -> float:
    """Smallest distance of a hand that wants through the partner's, and a partner that does not care."""
    x, v = rng.uniform(-0.1, 0.1, 3) + np.array((0.5, 0.0, 0.0)), np.zeros(3)
    p, w = rng.uniform(-0.1, 0.1, 3) - (0.3, 0.0, 0.0), np.zeros(3)
    most = CONFIG.partner_acceleration
    nearest = np.inf
    for _ in range(steps):
        aim = {"chases": x, "stands": p, "comes": np.array((0.6, 0.0, 0.0))}.get(kind)
        if aim is None:
            push = rng.standard_normal(3)
            push *= most / np.linalg.norm(push)
        else:
            push = 20.0 * (aim - p) - 4.0 * w
            push *= min(1.0, most / max(float(np.linalg.norm(push)), 1e-9))
        wanted = 15.0 * (np.array((-0.3, 0.0, 0.0)) - x) - 6.0 * v
        told = keep_separation(wanted, x, v, place(p, w), DT, CONFIG).acceleration
        assert np.linalg.norm(told) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
        x, v = x + v * DT + 0.5 * told * DT**2, v + told * DT
        p, w = p + w * DT + 0.5 * push * DT**2, w + push * DT
        nearest = min(nearest, float(np.linalg.norm(x - p)))
    return nearest


@pytest.mark.parametrize("kind", ["chases", "stands", "comes", "jitters"])
def test_the_separation_is_kept(kind: str) -> None:
    rng = np.random.default_rng(11)
    nearest = [encounter(rng, 400, kind) for _ in range(6)]
    assert min(nearest) >= CONFIG.separation - 1e-9
    assert max(nearest) < 0.9


vectors = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3).map(np.array)
points = st.lists(vectors, min_size=1, max_size=7).map(np.array)


@settings(max_examples=200, deadline=None)
@given(wanted=vectors, position=vectors, velocity=vectors)
def test_nothing_is_changed_that_need_not_be(wanted, position, velocity) -> None:
    found = keep_separation(wanted, position, velocity, place(ORIGIN), DT, CONFIG)
    assert np.isfinite(found.acceleration).all()
    assert np.linalg.norm(found.acceleration) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
    if not found.changed:
        assert found.acceleration == pytest.approx(wanted, abs=1e-9)
        return
    # Pushed outwards along the line of both hands, and nowhere else but to stay within bounds.
    outward = position / np.linalg.norm(position)
    change = found.acceleration - wanted
    assert change @ outward > 0.0
    if np.linalg.norm(found.acceleration) < CONFIG.hand_acceleration * (1.0 - 1e-6):
        assert np.cross(change, outward) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_far_partner_changes_nothing_and_nobody_does_not_either() -> None:
    wanted = np.array((1.0, 2.0, 3.0))
    for places in (place((-2.0, 0.0, 0.0)), NOWHERE):
        found = keep_separation(wanted, ORIGIN, AT_REST, places, DT, CONFIG)
        assert not found.changed
        assert found.acceleration == pytest.approx(wanted)


def least(position, velocity, places: Places, index: int) -> float:
    """What a barrier alone asks for along its line: what a hand that wants nothing gets."""
    alone = Places(*(values[index : index + 1] for values in vars(places).values()))
    outward = position - alone.position[0]
    outward = outward / np.linalg.norm(outward)
    found = keep_separation(-100.0 * outward, position, velocity, alone, DT, CONFIG)
    return float(found.acceleration @ outward)


@settings(max_examples=100, deadline=None)
@given(wanted=vectors, velocity=vectors, around=points, seed=st.integers(0, 99))
def test_of_many_places_each_is_kept_and_the_change_is_the_least(
    wanted, velocity, around, seed
) -> None:
    """Held against SciPy's general solver of such problems."""
    far = np.linalg.norm(around, axis=1) > 0.13
    around, speeds = around[far], np.random.default_rng(seed).normal(size=(far.sum(), 3))
    if not len(around):
        return
    places = Places(around, speeds, np.zeros(len(around)))
    found = keep_separation(wanted, ORIGIN, velocity, places, DT, CONFIG).acceleration
    outward = -around / np.linalg.norm(around, axis=1, keepdims=True)
    bounds = np.array([least(ORIGIN, velocity, places, index) for index in range(len(around))])
    bounds[bounds < -0.99 * CONFIG.hand_acceleration] = -1e3  # asks for nothing that matters here
    best = minimize(
        lambda a: 0.5 * float((a - wanted) @ (a - wanted)),
        found,
        jac=lambda a: a - wanted,
        method="SLSQP",
        constraints=[
            {"type": "ineq", "fun": lambda a: outward @ a - bounds, "jac": lambda _: outward},
            {
                "type": "ineq",
                "fun": lambda a: CONFIG.hand_acceleration**2 - a @ a,
                "jac": lambda a: -2.0 * a,
            },
        ],
        options={"ftol": 1e-12},
    )
    assert np.linalg.norm(found) <= CONFIG.hand_acceleration * (1.0 + 1e-9)
    if best.success and (outward @ best.x >= bounds - 1e-6).all():
        assert (outward @ found >= bounds - 2e-4).all()
        assert found == pytest.approx(best.x, abs=5e-3)


def test_whatever_can_be_met_is_met() -> None:
    """Bounds at random against a linear program over a ball that is a polytope from within."""
    rng = np.random.default_rng(0)
    sphere = rng.standard_normal((400, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    met = missed = 0
    for _ in range(400):
        count = int(rng.integers(2, 8))
        outward = rng.standard_normal((count, 3))
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        bounds = rng.uniform(-2.0, 8.0, count)
        wanted = rng.uniform(-8.0, 8.0, 3)
        found = nearest_allowed(wanted, outward, bounds, 8.0, count)
        assert np.linalg.norm(found) <= 8.0 * (1.0 + 1e-9)
        # The largest margin t with outward · a >= bounds + t, sphere · a <= 7.7.
        best = linprog(
            (0.0, 0.0, 0.0, -1.0),
            A_ub=np.vstack(
                (
                    np.column_stack((-outward, np.ones(count))),
                    np.column_stack((sphere, np.zeros(400))),
                )
            ),
            b_ub=np.concatenate((-bounds, np.full(400, 7.7))),
            bounds=(None, None),
        )
        margin = float((outward @ found - bounds).min())
        if -best.fun > 1e-3:
            assert margin >= -2e-4
            met += 1
        else:
            assert margin >= -best.fun - 1.0
            missed += 1
    assert min(met, missed) > 50


def test_a_fist_that_comes_from_behind_a_forearm_is_seen() -> None:
    """The elbow is nearest and stands; the hand behind it swings past it, towards the robot."""
    joints = np.array(((0.5, 0.5, 0.0), (0.2, 0.0, 0.0), (0.25, 0.0, 0.15), (0.25, 0.0, 0.22)))
    speeds = np.zeros((4, 3))
    speeds[3] = (-2.0, 0.0, -1.5)
    arm = Partner(joints[3], speeds[3], joints=joints, speeds=speeds)
    place_next, speed_next = arm.nearest(ORIGIN)
    wanted = np.zeros(3)
    nearest_only = keep_separation(
        wanted, ORIGIN, AT_REST, place(place_next, speed_next), DT, CONFIG
    )
    assert not nearest_only.changed
    found = keep_separation(wanted, ORIGIN, AT_REST, arm.places(ORIGIN), DT, CONFIG)
    assert found.changed
    away = -joints[3] / np.linalg.norm(joints[3])
    assert found.acceleration @ away > 1.0


def test_people_come_before_the_table() -> None:
    """From above, at the table: the hand goes through where the table was rather than into the person."""
    above = place((0.0, 0.0, 0.16), (0.0, 0.0, -1.5))
    found = keep_separation(np.zeros(3), ORIGIN, AT_REST, above, DT, CONFIG, floor=0.0)
    assert found.acceleration[2] == pytest.approx(-CONFIG.hand_acceleration)
    # Where there is room for both, both are kept.
    beside = place((0.16, 0.0, 0.02), (-0.69, 0.0, 0.0))
    down = np.array((0.0, 0.0, -5.0))
    found = keep_separation(down, ORIGIN, AT_REST, beside, DT, CONFIG, floor=0.0)
    assert found.acceleration[2] >= -1e-6
    assert found.acceleration[0] < -1.0


def test_what_was_seen_long_ago_is_kept_farther_away_from() -> None:
    asked = [
        keep_separation(
            np.array((5.0, 0.0, 0.0)), ORIGIN, np.array((1.0, 0.0, 0.0)), place((0.25, 0.0, 0.0), age=age),
            DT, CONFIG,
        ).acceleration[0]
        for age in (0.0, 0.05, 0.1)
    ]  # fmt: skip
    assert asked[0] >= asked[1] >= asked[2]
    assert asked[0] > asked[2]


def test_brakes_are_not_put_on_at_the_last_moment() -> None:
    """A hand that goes straight for somebody slows down in proportion, where a late filter jerks."""

    def jerk(config: SeparationConfig) -> tuple[float, float]:
        x, v, told = ORIGIN, np.array((0.8, 0.0, 0.0)), []
        standing = place((0.6, 0.0, 0.0))
        for _ in range(500):
            a = keep_separation(np.zeros(3), x, v, standing, DT, config).acceleration
            x, v = x + v * DT + 0.5 * a * DT**2, v + a * DT
            told.append(a[0])
        assert x[0] <= 0.5 + 1e-9
        return float(np.abs(np.diff(told)).max()), 0.5 - float(x[0])

    late, left_late = jerk(SeparationConfig(approach=1e6))
    soft, left_soft = jerk(CONFIG)
    assert soft < 0.3 * late
    # It comes as near, in the end.
    assert left_late < 0.01
    assert left_soft < 0.03


def test_many_hands_are_kept_as_each_alone() -> None:
    rng = np.random.default_rng(3)
    n = 400
    wanted, position, velocity, speed = (rng.standard_normal((n, 3)) for _ in range(4))
    partner = position + rng.uniform(-0.25, 0.25, (n, 3))
    partner[:4] = position[:4]
    found, changed = keep_separations(
        6.0 * wanted, position, velocity, partner[:, None], speed[:, None], DT, CONFIG
    )
    assert 0.2 < changed.mean() < 0.95
    for row in range(n):
        alone = place(partner[row], speed[row])
        one = keep_separation(6.0 * wanted[row], position[row], velocity[row], alone, DT, CONFIG)
        np.testing.assert_array_equal(found[row], one.acceleration)
        assert changed[row] == one.changed


def test_many_hands_are_kept_from_whole_arms() -> None:
    rng = np.random.default_rng(4)
    n = 100
    wanted, position, velocity = (rng.standard_normal((n, 3)) for _ in range(3))
    joints = position[:, None] + rng.uniform(-0.4, 0.4, (n, 4, 3))
    speeds = rng.standard_normal((n, 4, 3))
    found, changed = keep_separations(6.0 * wanted, position, velocity, joints, speeds, DT, CONFIG)
    for row in range(n):
        arm = Partner(joints[row, 3], speeds[row, 3], joints=joints[row], speeds=speeds[row])
        places = arm.places(position[row])
        one = keep_separation(6.0 * wanted[row], position[row], velocity[row], places, DT, CONFIG)
        np.testing.assert_array_equal(found[row], one.acceleration)
        assert changed[row] == one.changed


def test_places_are_put_together() -> None:
    both = together([place((1.0, 0.0, 0.0), age=0.1), place((2.0, 0.0, 0.0))])
    assert both.position[:, 0].tolist() == [1.0, 2.0]
    assert both.age.tolist() == [0.1, 0.0]


def test_a_partner_as_quick_as_the_hand_is_refused() -> None:
    with pytest.raises(ConfigError, match="partner_acceleration = 8"):
        SeparationConfig(partner_acceleration=8.0)
