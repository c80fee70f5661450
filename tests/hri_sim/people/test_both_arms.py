"""A simulated person with both arms: the second changes nothing of the first."""

from __future__ import annotations

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.tracks.track import ArmSample
from hri_sim.nodes.arms import TrueArms
from hri_sim.people.capture import Capture, CapturedArm
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.seeding import tracking_generator
from hri_sim.people.tracking import TrackingModel
from hri_sim.scenario.schema import PersonSpec
from hri_sim.scenario.shipped import load_shipped

MS = 1_000_000


def captured(person: PersonSpec, seconds: float = 2.0) -> list[ArmSample]:
    """What motion capture delivers of a person who makes a reach."""
    arms = []
    for number, spec in enumerate(person.arms.values()):
        whole = SimulatedPerson(spec, 1)
        if not number:
            whole.plan_reach((0.40, -0.10, 0.15), 0.5, 1.0)
        tracking = TrackingModel(spec, tracking_generator(3, person.id, number))
        arms.append(CapturedArm(whole.truth, spec.side, tracking))
    capture = Capture({person.id: arms}, 0)
    found = []
    for now_ns in range(0, round(seconds * 1e9), 4 * MS):
        list(capture.truth(now_ns))
        found += [sample for _, sample in capture.tracked(now_ns)]
    return found


def test_the_second_arm_rests_beside_the_first_with_noise_of_its_own() -> None:
    person = PersonSpec(both_arms=True)
    both = captured(person)
    first = [sample for sample in both if sample.side == "right"]
    second = [sample for sample in both if sample.side == "left"]
    assert len(first) == len(second) > 450
    alone = captured(PersonSpec())
    for one, same in zip(alone, first, strict=True):
        assert one.stamp_ns == same.stamp_ns
        np.testing.assert_array_equal(one.keypoints, same.keypoints)
        np.testing.assert_array_equal(one.valid, same.valid)
    other = person.other
    assert other is not None
    noise = np.array([sample.keypoints for sample in second]) - other.arm.posture(
        other.home, other.swivel
    )
    assert np.nanstd(noise) == pytest.approx(person.noise_sd, rel=0.1)
    noises = np.array([sample.keypoints[0] for sample in first]) - person.shoulder
    seen = np.array([a.valid[0] and b.valid[0] for a, b in zip(first, second, strict=True)])
    together = np.corrcoef(noises[seen, 0], noise[seen, 0, 0])[0, 1]
    assert abs(together) < 0.15


def sample(side: str, x: float) -> ArmSample:
    return ArmSample(4 * MS, np.full((4, 3), x), np.ones(4, dtype=bool), side)


def test_true_arms_of_a_body_are_told_apart() -> None:
    scenario = load_shipped("table_reach")
    (person,) = scenario.persons
    whole = person.model_copy(update={"both_arms": True})
    arms = TrueArms(scenario.model_copy(update={"persons": (whole,)}))
    for side, x in (("left", 1.0), ("right", 2.0)):
        arms.add("person1", sample(side, x))
    places = {name: timeline.at(4 * MS) for name, timeline in arms.timelines.items()}
    assert {name: place[0, 0] for name, place in places.items() if place is not None} == {
        "person1": 2.0,
        "person1/left": 1.0,
    }


def test_a_person_of_one_arm_keeps_the_one_that_was_heard_first() -> None:
    """A recording of a left arm in a scene of a right one is shown; both are not mixed up as one."""
    arms = TrueArms(load_shipped("table_reach"))
    arms.add("person1", sample("left", 1.0))
    with pytest.raises(DataError, match=r"the right arm of person1 is not in the scene.*both_arms"):
        arms.add("person1", sample("right", 2.0))
    place = arms.timelines["person1"].at(4 * MS)
    assert place is not None
    assert place[0, 0] == 1.0
    with pytest.raises(DataError, match="no person 'bob'"):
        arms.add("bob", sample("left", 1.0))
