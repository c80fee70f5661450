"""The simple predictors on reaches of which the answer is known."""

import dataclasses

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.evaluation.baselines import MeanTrajectory, MinimumJerk, PlainProMP
from hri_prediction.evaluation.observation import Example, Observation, examples, fitting
from hri_prediction.tracks.track import ArmTrack

RNG = np.random.default_rng(3)
PHASES = np.linspace(0.0, 1.0, 31)
SHARE = PHASES**3 * (10.0 - 15.0 * PHASES + 6.0 * PHASES**2)


def straight(end: np.ndarray, duration: float, task: str = "a", side: str = "right") -> Example:
    wrist = np.array([0.2, 0.0, -0.3]) + SHARE[:, None] * (end - [0.2, 0.0, -0.3])
    return Example(np.hstack([0.5 * wrist, wrist]), duration, task, side)


def observed(example: Example, share: float, told: bool) -> tuple[Observation, np.ndarray]:
    """The beginning of an example as a track about a shoulder at (1, 2, 3), and its end there."""
    shoulder = np.array([1.0, 2.0, 3.0])
    time = np.arange(-0.1, share * example.duration_s, 0.01)
    phase = np.clip(time / example.duration_s, 0.0, 1.0)
    arm = np.stack([np.interp(phase, PHASES, column) for column in example.values.T], axis=1)
    points = np.stack([0.0 * arm[:, :3], arm[:, :3], arm[:, 3:], 1.2 * arm[:, 3:]], axis=1)
    track = ArmTrack(time, points + shoulder)
    return (
        Observation(track, 0.0, example.duration_s if told else None),
        example.values[-1, 3:] + shoulder,
    )


@pytest.fixture(scope="module")
def known() -> list[Example]:
    ends = np.array([0.5, 0.1, 0.0]) + 0.1 * RNG.standard_normal((40, 3))
    return [straight(end, float(RNG.uniform(0.8, 1.4))) for end in ends]


@pytest.mark.parametrize("told", [True, False])
def test_minimum_jerk_fit_finds_where_a_minimum_jerk_reach_ends(known, told):
    fit = MinimumJerk(known)
    example = straight(np.array([0.6, 0.3, -0.1]), 1.2)
    errors = []
    for share in (0.3, 0.6, 0.9):
        seen, end = observed(example, share, told)
        said = fit.forecast(seen, np.array([1.2]))
        errors.append(np.linalg.norm(said.mean[0] - end))
        assert np.linalg.eigvalsh(said.covariance[0]).min() > 0.0
    assert errors[2] < 0.01
    assert errors[2] < errors[0]


def test_before_anything_moves_the_minimum_jerk_fit_is_its_prior(known):
    seen, _ = observed(known[0], 0.01, True)
    said = MinimumJerk(known).forecast(seen, np.array([10.0]))
    ends = np.array([e.values[-1, 3:] for e in known])
    np.testing.assert_allclose(said.mean[0], seen.shoulder + ends.mean(axis=0), atol=1e-6)
    expected = np.cov(ends.T) * (1.0 + 1.0 / 40.0) + 8e-6 * np.eye(3)
    np.testing.assert_allclose(said.covariance[0], expected, atol=1e-6)


def test_mean_trajectory_does_not_look(known):
    mean = MeanTrajectory(known)
    early, _ = observed(known[0], 0.2, True)
    late, _ = observed(known[0], 0.8, True)
    times = known[0].duration_s * np.array([0.0, 0.5, 1.0, 3.0])
    one, other = mean.forecast(early, times), mean.forecast(late, times)
    np.testing.assert_array_equal(one.mean, other.mean)
    values = np.stack([e.values[:, 3:] for e in known])
    np.testing.assert_allclose(one.mean[1] - early.shoulder, values[:, 15].mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(one.mean[2], one.mean[3])
    expected = np.cov(values[:, -1].T) * (1.0 + 1.0 / 40.0) + 4e-6 * np.eye(3)
    np.testing.assert_allclose(one.covariance[2], expected)


def test_plain_promp_uses_what_it_sees(known):
    pytest.importorskip("movement_primitives")
    promp = PlainProMP(known)
    example = straight(np.array([0.55, 0.2, -0.05]), 1.0)
    errors, spreads = [], []
    for share in (0.1, 0.5, 0.9):
        seen, end = observed(example, share, True)
        said = promp.forecast(seen, np.array([0.95, 1.0]))
        errors.append(np.linalg.norm(said.mean[1] - end))
        spreads.append(np.trace(said.covariance[1]))
    assert errors[2] < 0.02 < errors[0]
    assert spreads[2] < spreads[1] < spreads[0]


def test_plain_promp_reads_the_wrist_at_each_time(known):
    """Blocks of the package's covariance, one time at a time, and unchanged phases of the caller."""
    pytest.importorskip("movement_primitives")
    promp = PlainProMP(known)
    seen, _ = observed(known[0], 0.4, True)
    times = np.array([0.5, 0.7])
    both = promp.forecast(seen, times)
    for k, time in enumerate(times):
        alone = promp.forecast(seen, np.array([time]))
        np.testing.assert_allclose(both.mean[k], alone.mean[0], atol=1e-12)
        np.testing.assert_allclose(both.covariance[k], alone.covariance[0], atol=1e-12)
    np.testing.assert_array_equal(times, [0.5, 0.7])


def test_examples_of_a_side_and_task_are_preferred(known):
    mixed = [known[0], straight(np.ones(3), 1.0, "b"), straight(np.ones(3), 1.0, "a", "left")]
    assert fitting(mixed, "left", None) == [mixed[2]]
    assert fitting(mixed, "right", None) == mixed[:2]
    assert fitting(mixed, "right", "b") == [mixed[1]]
    assert fitting(mixed, "right", "c") == mixed[:2]
    assert fitting(mixed[:2], "left", None) == mixed[:2]


def test_examples_are_cut_where_they_are_labelled_or_found(recordings):
    labelled, found = (
        examples(recordings[:1], labelled=True),
        examples(recordings[:1], labelled=False),
    )
    assert labelled[0].duration_s == recordings[0].reaches[0].duration_s
    assert found[0].duration_s == pytest.approx(labelled[0].duration_s, abs=0.2)
    assert found[0].duration_s != labelled[0].duration_s


def test_observed_samples_leave_out_what_was_not_seen(known):
    seen, _ = observed(known[0], 0.5, True)
    points = np.array(seen.track.keypoints)
    points[-3:, 2] = np.nan
    points[:15, 0] = np.nan
    gappy = Observation(dataclasses.replace(seen.track, keypoints=points), 0.0, None)
    times, values = gappy.samples()
    assert np.isfinite(values).all()
    assert times[-1] == seen.track.time_s[-4]
    assert times[0] >= -1e-6
    np.testing.assert_allclose(np.diff(times), 0.02)
    np.testing.assert_allclose(gappy.shoulder, [1.0, 2.0, 3.0])
    points[:, 0] = np.nan
    blind = Observation(dataclasses.replace(seen.track, keypoints=points), 0.0, None)
    assert np.isnan(blind.shoulder).all()


def test_nothing_to_learn_from_is_refused():
    with pytest.raises(DataError, match="no reach"):
        MeanTrajectory([])
