"""Two people who reach turn after turn, and what motion capture sees of them."""

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.placement import Placement
from hri_sim.dyads.bodies import dyad_bodies, named_person
from hri_sim.dyads.motion import DyadMotion
from hri_sim.dyads.setups import draw_setup
from hri_sim.people.capture import MAX_CATCH_UP, Capture
from hri_sim.people.seeding import dyad_generator
from hri_sim.people.tracking import SAMPLE_PERIOD_NS


def motion(seed: int = 0, encounters: int = 0) -> DyadMotion:
    rng = dyad_generator(seed)
    setup = draw_setup("x", "opposite", rng)
    return DyadMotion(setup, rng, pause=0.4, encounters=encounters)


def capture(seed: int, encounters: int = 0) -> Capture:
    moved = motion(seed, encounters)
    return Capture(dyad_bodies(moved, ("ann", "bob"), seed, Placement(0.85, yaw=0.5)), 0)


def test_how_far_ahead_an_arm_is_found_out_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for ahead in (1, 8):
        monkeypatch.setattr("hri_sim.dyads.bodies.AHEAD", ahead)
        arms = dyad_bodies(motion(), ("ann", "bob"), 0, Placement(0.85, yaw=0.5))
        # Back a little, as captures are that were skipped.
        steps = [*range(700), 690, *range(700, 705)]
        found.append([arms[name][0].truth(0.004 * step) for step in steps for name in arms])
    np.testing.assert_allclose(found[0], found[1], rtol=0.0, atol=1e-12)


def test_encounters_follow_each_other_with_rests_between() -> None:
    dyad = motion(encounters=3)
    hands = np.array([dyad.at(step) for step in range(5000)])
    np.testing.assert_array_equal(hands[0], dyad.setup.places[:, 0])
    speed = np.linalg.norm(np.diff(hands, axis=0), axis=2) / 0.004
    assert dyad.begun == 3
    assert dyad.resting
    assert not speed[-500:].any()
    acceleration = np.diff(hands, n=2, axis=0) / 0.004**2
    assert np.abs(acceleration).max() < 10.0  # nothing jumps
    rests = (speed < 1e-9).all(axis=1)
    pauses = np.flatnonzero(np.diff(np.concatenate(([False], rests, [False])).astype(int)) == 1)
    assert len(pauses) == 4
    assert speed[:, 0].max() > 0.3 < speed[:, 1].max()


def test_what_is_long_past_cannot_be_asked_for() -> None:
    dyad = motion()
    first = dyad.at(100)
    np.testing.assert_array_equal(dyad.at(100), first)
    dyad.at(300)
    with pytest.raises(DataError, match="step 100 after step 300"):
        dyad.at(100)


def test_the_same_seed_gives_the_same_bodies() -> None:
    def seen(seed: int) -> np.ndarray:
        found = capture(seed)
        list(found.truth(1_200_000_000))
        samples = list(found.tracked(1_200_000_000))
        assert {name for name, _ in samples} == {"ann", "bob"}
        return np.array([sample.keypoints for _, sample in samples])

    np.testing.assert_array_equal(seen(3), seen(3))
    assert np.nanmax(np.abs(seen(3) - seen(4))) > 0.05


def test_truth_is_said_ahead_and_samples_come_late() -> None:
    found = capture(0)
    truth = [sample.stamp_ns for name, sample in found.truth(0) if name == "ann"]
    assert truth == [SAMPLE_PERIOD_NS, 2 * SAMPLE_PERIOD_NS]
    assert not list(found.tracked(2 * SAMPLE_PERIOD_NS))  # 8 ms on their way
    samples = [sample for name, sample in found.tracked(3 * SAMPLE_PERIOD_NS) if name == "bob"]
    assert [sample.stamp_ns for sample in samples] == [SAMPLE_PERIOD_NS]


def test_captures_that_are_too_late_are_skipped() -> None:
    found = capture(0)
    assert found.skip(MAX_CATCH_UP * SAMPLE_PERIOD_NS) == 0
    late = 500 * SAMPLE_PERIOD_NS
    assert found.skip(late) == 499
    stamps = [sample.stamp_ns for _, sample in found.truth(late)]
    assert min(stamps) == late
    list(found.tracked(late))
    assert len(list(found.tracked(late + 2 * SAMPLE_PERIOD_NS))) == 2


def test_names_that_no_body_can_have_are_refused() -> None:
    with pytest.raises(ConfigError, match="body 'per son'"):
        named_person("per son")
