"""How the hands of a dyad move."""

from dataclasses import replace

import numpy as np
import pytest

from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_sim.dyads.drawing import draw_reaches
from hri_sim.dyads.hands import LAWS, STEP_S, Reaches, simulate
from hri_sim.dyads.recording import SECONDS, draw_encounters
from hri_sim.dyads.setups import draw_setup, draw_setups

RNG = np.random.default_rng
DURATION_S = 3.2


def crossing(law: str = "push") -> Reaches:
    """Two slow hands on crossing ways; no noise, no lift."""
    each = np.full((1, 2), 1.0)
    return Reaches(
        start=np.array((((-0.3, 0.0, 0.1), (0.02, 0.3, 0.1)),)),
        goal=np.array((((0.3, 0.0, 0.1), (0.02, -0.3, 0.1)),)),
        onset=0.1 * each,
        duration=DURATION_S * each,
        lift=0.0 * each,
        gain=0.3 * each,
        patience=0.5 * each,
        delay=0.15 * each,
        noise=0.0 * each,
        law=np.full((1, 2), LAWS.index(law)),
        bow=np.zeros((1, 2, 3)),
    )


def nearest(hands: np.ndarray) -> float:
    """Smallest distance of both hands [m]."""
    return float(np.linalg.norm(hands[0, :, 0] - hands[0, :, 1], axis=1).min())


def test_reaches_end_at_their_goals() -> None:
    rng = RNG(0)
    for setup in draw_setups(3, rng):
        reaches = draw_reaches(setup, 30, rng)
        error = np.linalg.norm(simulate(reaches, SECONDS, rng)[:, -1] - reaches.goal, axis=2)
        assert np.median(error) < 0.002
        assert error.max() < 0.04  # where the other's hand rests close by


def test_an_undisturbed_reach_is_minimum_jerk_with_a_lift() -> None:
    one = replace(crossing("none"), lift=np.full((1, 2), 0.2))
    hands = simulate(one, 3.0, RNG(0))[0]
    share = minimum_jerk((np.arange(len(hands)) * STEP_S - 0.1) / DURATION_S)
    way = one.start[0] + share[:, None, None] * (one.goal - one.start)[0]
    np.testing.assert_allclose(hands[..., :2], way[..., :2], atol=0.004)
    lift = hands[:, 0, 2] - 0.1
    assert lift.max() == pytest.approx(0.2 * 0.6, abs=0.001)
    assert int(lift.argmax()) * STEP_S == pytest.approx(0.1 + 0.5 * DURATION_S, abs=0.02)


def test_hands_give_way_after_the_reaction_time() -> None:
    met, alone = (simulate(crossing(law), 4.0, RNG(0)) for law in ("push", "none"))
    assert nearest(alone) < 0.02
    assert nearest(met) > 0.07
    # What counts is where both will be nearest within the next third of a second.
    offset = alone[0, 1:, 0] - alone[0, 1:, 1]
    drift = np.diff(alone[0, :, 0] - alone[0, :, 1], axis=0) / STEP_S
    closing = -np.einsum("ti,ti->t", offset, drift)
    until = np.clip(closing / np.maximum((drift**2).sum(axis=1), 1e-9), 0.0, 0.35)
    foreseen = np.linalg.norm(offset + until[:, None] * drift, axis=1)
    seen = 1 + int(np.flatnonzero((foreseen < 0.4) & (until > 0.0))[0])
    differ = int(np.flatnonzero(np.abs(met - alone)[0].max(axis=(1, 2)) > 1e-12)[0])
    assert (differ - seen) * STEP_S == pytest.approx(0.15, abs=3 * STEP_S)


def test_laws_differ() -> None:
    hands = {law: simulate(crossing().with_partner(law), SECONDS, RNG(0)) for law in LAWS}
    partner = {law: found[0, :, 1] for law, found in hands.items()}
    for index, law in enumerate(LAWS):
        for other in LAWS[index + 1 :]:
            assert np.abs(partner[law] - partner[other]).max() > 0.01, (law, other)
        assert np.linalg.norm(partner[law][-1] - (0.02, -0.3, 0.1)) < 0.005, law
    assert partner["none"][:, 0] == pytest.approx(0.02)
    assert np.ptp(partner["push"][:, 2]) > 0.05
    assert np.ptp(partner["sidestep"][:, 2]) < 1e-9 < 0.03 < np.ptp(partner["sidestep"][:, 0])
    there = {
        law: int(np.flatnonzero(np.abs(path[:, 1] + 0.3) > 0.01)[-1])
        for law, path in partner.items()
    }
    assert there["hesitate"] > there["none"] + 20


def test_the_same_seed_gives_the_same() -> None:
    setup = draw_setup("x", "opposite", RNG(1))
    first, again, other = (draw_encounters([setup], 3, RNG(seed)) for seed in (5, 5, 6))
    for one, two, three in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(one.hand, two.hand)
        np.testing.assert_array_equal(one.partner, two.partner)
        assert one.hand.shape != three.hand.shape or np.abs(one.hand - three.hand).max() > 0.01


def test_encounters_begin_and_end_at_rest_and_know_their_direction() -> None:
    setup = draw_setup("x", "corner", RNG(1))
    found = draw_encounters([setup], 40, RNG(2))
    assert 5 < sum(one.backward for one in found) < 25
    for one in found:
        assert np.linalg.norm(one.hand[1] - one.hand[0]) < 0.005
        assert np.linalg.norm(one.hand[-1] - one.hand[-2]) < 0.003
        np.testing.assert_array_equal(one.goal, one.hand[-1])
        at_home = np.linalg.norm(one.goal - setup.places[0, 0]) < 0.04
        assert at_home == one.backward


def test_a_bow_leads_round_the_middle() -> None:
    alone = replace(crossing("none"), law=np.full((1, 2), LAWS.index("none")))
    bow = np.array(((0.0, 0.1, 0.05), (0.0, 0.0, 0.0)))[None]
    straight, round_it = (
        simulate(reaches, SECONDS, RNG(0))[0, :, 0] for reaches in (alone, replace(alone, bow=bow))
    )
    aside = round_it - straight
    np.testing.assert_allclose(aside[np.abs(aside[:, 1]).argmax()], bow[0, 0], atol=1e-3)
    np.testing.assert_allclose(aside[[0, -1]], 0.0, atol=1e-9)
