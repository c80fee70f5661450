"""What simulated people avoid, and what is learnt of it as motion capture sees it."""

from __future__ import annotations

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.ontology.cases import cases, find_case
from hri_prediction.ontology.costs import NUMBER, path_costs
from hri_prediction.ontology.features import COUNT, EXCHANGED, FEATURES
from hri_prediction.ontology.movements import (
    ARM_SPREAD,
    SPREAD,
    TRUNK,
    Movement,
    cost_differences,
    cost_scale,
    learn_costs,
    movements_of,
)
from hri_prediction.ontology.piirl import cosine
from hri_prediction.ontology.synthetic import optimal_movement
from hri_sim.ontology.avoidance import SMOOTHNESS_SHARE, avoiding, shares_of, truth_of
from hri_sim.ontology.captured import captured
from hri_sim.ontology.case_costs import simulated_sessions
from hri_sim.ontology.sessions import DyadStudy, record_session


def some_movements(case: str, noise: float = 0.0005) -> list[Movement]:
    study = DyadStudy(encounters=6, noise=noise)
    session = simulated_sessions(case, study, 1, 0)[0]
    return movements_of(record_session(session, study))


def test_each_edge_adds_what_it_brings_near() -> None:
    for case in cases():
        shares = shares_of(case)
        # Movements of both are agent 1's.
        np.testing.assert_array_equal(shares, shares[EXCHANGED])
        assert shares[FEATURES.index("hand-hand")] == 1.0
        assert shares[FEATURES.index("hand tip-elbow")] == case.shared
        assert shares[FEATURES.index("hand-forearm")] == sum(case.over)
        assert shares[FEATURES.index("forearm-forearm")] == case.crossing
    assert len({tuple(shares_of(case)) for case in cases()}) >= 14


def test_people_who_avoid_pay_less_and_their_trunk_stays() -> None:
    movements = some_movements("case_13")
    rng = np.random.default_rng(0)
    truth, found = avoiding(find_case("case_13"), movements, ARM_SPREAD, rng)
    assert (truth >= 0.0).all()
    assert truth[COUNT] > 0.0
    for before, after in zip(movements, found, strict=True):
        paths = np.stack((before.joints, after.joints))
        first, then = path_costs(before.body, paths, before.partner, before.step_s) @ truth
        assert then < first
        np.testing.assert_array_equal(after.joints[:, :TRUNK], before.joints[:, :TRUNK])
        np.testing.assert_array_equal(after.joints[[0, -1]], before.joints[[0, -1]])


@pytest.mark.parametrize("spread", [SPREAD, ARM_SPREAD])
def test_the_dearest_nearness_is_worth_a_twentieth_of_smoothness(spread: np.ndarray) -> None:
    movements = some_movements("case_3")
    case = find_case("case_3")
    truth = truth_of(case, movements, spread, np.random.default_rng(0))
    again = truth_of(case, movements, spread, np.random.default_rng(0))
    np.testing.assert_array_equal(truth, again)
    charged = truth[:COUNT] > 0.0
    np.testing.assert_array_equal(charged, shares_of(case) > 0.0)
    assert np.unique(truth[:COUNT][charged]).size == 1  # one edge: all shares are 1
    scaled = truth * cost_scale(movements, np.random.default_rng(0), spread)
    assert scaled[:COUNT].max() == pytest.approx(scaled[COUNT] / SMOOTHNESS_SHARE)
    with pytest.raises(DataError, match="no movements of case_3"):
        truth_of(case, [], spread, np.random.default_rng(0))


@pytest.mark.parametrize("case", ["case_1", "case_3", "case_13"])
def test_motion_capture_blurs_what_is_learnt_and_its_noise_hardly_does(case: str) -> None:
    """What nearness costs is found; of which parts is not, as that of one is like that of the next."""
    movements = some_movements(case)
    truth, optimal = avoiding(find_case(case), movements, ARM_SPREAD, np.random.default_rng(1))
    learnt = {}
    for noise in (0.0, 0.0005):
        rng = np.random.default_rng(2)
        seen = [captured(movement, noise, rng) for movement in optimal]
        for one, was in zip(seen, optimal, strict=True):
            aside = one.body.keypoints(one.joints) - was.body.keypoints(was.joints)
            # Parabolas through 160 ms cut what is sharp.
            assert np.linalg.norm(aside, axis=-1).max() < 0.03
        learnt[noise] = learn_costs(seen, rng, spread=ARM_SPREAD)
    differences = cost_differences(optimal, np.random.default_rng(3), ARM_SPREAD)[:, :COUNT]
    costs = {noise: differences @ one.weights[:COUNT] for noise, one in learnt.items()}
    assert cosine(costs[0.0], costs[0.0005]) > 0.95
    assert cosine(costs[0.0005], differences @ truth[:COUNT]) > 0.8


def test_nearness_bends_arms_by_centimetres() -> None:
    movements = some_movements("case_3")
    spread = ARM_SPREAD
    truth, found = avoiding(find_case("case_3"), movements, spread, np.random.default_rng(0))
    alone = np.where(np.arange(NUMBER) < COUNT, 0.0, truth)
    bends = []
    for before, after in zip(movements, found, strict=True):
        smoothest = optimal_movement(before, alone, free=spread > 0.0)
        moved = after.body.keypoints(after.joints) - after.body.keypoints(smoothest.joints)
        bends.append(np.linalg.norm(moved, axis=-1).max())
    assert 0.01 < np.median(bends) < 0.15
