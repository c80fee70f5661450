"""What is seen of an arm that is followed: where it rests, and reaches that have ended."""

from dataclasses import replace

import numpy as np
import pytest

from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.watch import ArmWatch
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample

KEY = TaskKey("right", "rest", "near")


def samples_of(rest, way, side="right"):
    """An arm that rests, goes along a way (P, 6) from the shoulder within 0.8 s, and rests."""
    shoulder = rest.points[0]
    phases = np.concatenate([np.zeros(100), np.linspace(0.0, 1.0, 200), np.ones(100)])
    rise = phases**3 * (10.0 - 15.0 * phases + 6.0 * phases**2)
    for number, share in enumerate(rise):
        points = np.zeros((4, 3))
        elbow_wrist = np.array(
            [np.interp(share, np.linspace(0.0, 1.0, len(way)), column) for column in way.T]
        ).reshape(2, 3)
        points[1:3] = elbow_wrist
        forearm = elbow_wrist[1] - elbow_wrist[0]
        points[3] = elbow_wrist[1] + 0.09 * forearm / np.linalg.norm(forearm)
        yield ArmSample(4_000_000 * (number + 1), points + shoulder, np.ones(4, dtype=bool), side)


def test_a_watch_sees_rest_and_reaches(targets, people, rest):
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found = []
    for sample in samples_of(rest, way):
        predictor.observe(sample)
        watch.observe(sample, predictor)
        found += watch.questions()
    kinds = [type(each) for each in found]
    assert kinds == [Rest, SeenReach, Rest]
    reach = found[1]
    assert watch.unusable == 0
    assert 0.5 < reach.duration_s < 0.8
    np.testing.assert_allclose(reach.values[0], way[0], atol=0.01)
    np.testing.assert_allclose(reach.values[-1], way[-1], atol=0.01)
    assert found[0].body.arm.upper_m == pytest.approx(rest.body.arm.upper_m, abs=0.002)
    # And the loop takes both.
    assert person.reached(reach) == KEY


@pytest.mark.parametrize(
    ("hidden", "usable"),
    [(range(200, 220), True), (range(200, 240), False), (range(240, 400), False)],
)
def test_a_reach_of_which_too_little_is_seen_is_not_learnt(targets, people, rest, hidden, usable):
    """An elbow behind something: 80 ms are made up for, not 160, nor the end of the reach."""
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor, found = ReachPredictor(), []
    for number, sample in enumerate(samples_of(rest, person.tasks[KEY].path.values)):
        valid = np.array([True, number not in hidden, True, True])
        seen = replace(sample, valid=valid)
        predictor.observe(seen)
        watch.observe(seen, predictor)
        found += watch.questions()
    assert any(isinstance(each, SeenReach) for each in found) == usable
    assert watch.unusable == (not usable)


def test_late_and_repeated_samples_do_no_harm(targets, people, rest):
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found, before = [], None
    for number, sample in enumerate(samples_of(rest, way)):
        for each in (sample, before) if number % 40 == 39 else (sample,):
            predictor.observe(each)
            watch.observe(each, predictor)
            found += watch.questions()
        before = sample
    assert [type(each) for each in found] == [Rest, SeenReach, Rest]


def test_only_reaches_from_rest_are_learnt(targets, people, rest):
    """There and back again without a rest: the second part begins in mid-air."""
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    there = list(samples_of(rest, way))[:250]
    back = there[100:][::-1] + there[:100]
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found = []
    for number, sample in enumerate([*there, *back]):
        stamped = ArmSample(4_000_000 * (number + 1), sample.keypoints, sample.valid, "right")
        predictor.observe(stamped)
        watch.observe(stamped, predictor)
        found += watch.questions()
    assert not any(isinstance(each, SeenReach) for each in found)


def test_a_predictor_takes_a_library_between_reaches_only(targets, people, rest):
    person = HybridPerson(targets, people)
    library = person.at_rest(rest)
    way = person.tasks[KEY].path.values
    predictor = ReachPredictor()
    taken = []
    for sample in samples_of(rest, way):
        predictor.observe(sample)
        taken.append(predictor.expect(library))
    assert taken[0]
    assert not all(taken)
    assert taken[-1]
    # Known from the start, the reach is recognised on the way.
    predictor = ReachPredictor()
    likeliest = ""
    for number, sample in enumerate(samples_of(rest, way)):
        predictor.observe(sample)
        if number == 0:
            predictor.expect(library)
        if number == 220:
            prediction = predictor.predict()
            likeliest = prediction.task_names[int(np.argmax(prediction.task_probabilities))]
    assert likeliest == "near_from_rest"
