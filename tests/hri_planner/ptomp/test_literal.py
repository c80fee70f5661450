"""The literal collision cost (eq. 6.10) against plain distances."""

import numpy as np

from hri_planner.ptomp import HumanForecast, PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.layout import FIRST_FREE
from hri_planner.robot import load_robot
from hri_prediction.geometry.segments import closest_parameters

ROBOT = load_robot()
RADII = np.array([0.05, 0.04, 0.05])
ARM = np.array([[0.8, 0.0, 0.5], [0.7, 0.1, 0.3], [0.5, 0.0, 0.35], [0.4, 0.0, 0.3]])
SPREAD = np.array([0.01, 0.02, 0.03, 0.04])
MARGIN, KAPPA, K = 0.06, 0.5, 3.0


def _place(q):
    """Distance along the arm from the tool to the nearest point, 0 when it is not near."""
    frames = ROBOT.frames(q)
    chain = np.concatenate(([[0.0, 0.0, ROBOT.lengths[0]]], frames[1:4]))
    lengths = np.linalg.norm(np.diff(chain, axis=0), axis=1)
    found = []
    for part in range(3):
        for limb in range(3):
            s, t, squared = closest_parameters(
                chain[part], chain[part + 1], ARM[limb], ARM[limb + 1]
            )
            gap = np.sqrt(squared) - ROBOT.capsule_radii[part] - RADII[limb]
            spread = SPREAD[limb] + t * (SPREAD[limb + 1] - SPREAD[limb])
            place = (1.0 - s) * lengths[part] + lengths[part + 1 :].sum()
            found.append((gap, place if gap <= MARGIN + KAPPA * spread else 0.0))
    return min(found)[1]


def test_it_is_k_times_the_place_of_the_nearest_point():
    rng = np.random.default_rng(0)
    config = PtompConfig(
        collision_cost="literal", collision_weight=K, contact_weight=0.0, kappa=KAPPA
    )
    model = CostModel(ROBOT, config, None)
    people = HumanForecast(0.0, 0.1, ARM[None], SPREAD[None], RADII)
    columns, step = 40, 0.03
    model.bind(step * np.arange(-2.0, columns - 2.0), np.zeros(3), [people], MARGIN)
    postures = rng.uniform(-1.0, 1.0, (columns, 7)) + np.radians([0, -40, 0, 90, 0, -40, 0])
    terms = model.evaluate(np.ascontiguousarray(postures.T)[None])[1]
    places = np.array([_place(q) for q in postures[FIRST_FREE:]])
    assert 3 < np.count_nonzero(places) < columns - 5
    np.testing.assert_allclose(terms[0, 0], K * step * places.sum(), rtol=1e-9)
