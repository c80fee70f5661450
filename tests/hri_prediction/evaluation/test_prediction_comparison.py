"""Recorded predictions beside those made offline: what is the same, and what gives a difference away."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from typer.testing import CliRunner

from hri_prediction.bags.arms import ARM_TYPE
from hri_prediction.bags.metadata import TopicInfo
from hri_prediction.bags.predictions import PREDICTION_TYPE, recorded_predictions
from hri_prediction.bags.reader import BagReader
from hri_prediction.bags.writer import BagWriter
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.evaluation import cli
from hri_prediction.evaluation.comparison import Comparison, compare_bags, predict_bag
from hri_prediction.evaluation.recordings import Recording
from hri_prediction.evaluation.replay import replay
from hri_prediction.prediction import (
    Prediction,
    PredictorConfig,
    ReachPredictor,
    ReachState,
    TaskLibrary,
    train_library,
)
from hri_prediction.ros.arm_bag import START_NS, write_arm_bag
from hri_prediction.ros.conversions import message_from_prediction, message_from_sample
from hri_prediction.tracks.track import ArmSample, ArmTrack
from hri_prediction.warm import warm_kernels

LATER_NS = 1_700_000_000_123_456_789
Change = Callable[[int, ArmSample], ArmSample | None]


@pytest.fixture(scope="module")
def track(recordings: list[Recording]) -> ArmTrack:
    """A reach during which nothing is seen for a while, and then the hand tip not."""
    warm_kernels()
    track = recordings[0].track
    points = np.array(track.keypoints)
    points[12:24] = np.nan
    points[60:70, 3] = np.nan
    return dataclasses.replace(track, keypoints=points)


@pytest.fixture(scope="module")
def library(recordings: list[Recording], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("library") / "library.npz"
    train_library([r.track for r in recordings[1:6]]).save(path)
    return path


@pytest.fixture
def source(tmp_path: Path, track: ArmTrack) -> Path:
    write_arm_bag(tmp_path / "source", track)
    return tmp_path / "source"


@pytest.fixture
def live(tmp_path: Path, track: ArmTrack, library: Path) -> Callable[..., Path]:
    """Writes what the recorder keeps of a replay: arms at later stamps, and a prediction in two."""

    def write(
        change: Change | None = None, named: str | None = None, speed: float = 1.0, every: int = 2
    ) -> Path:
        folder = tmp_path / "live"
        predictor = ReachPredictor(TaskLibrary.load(library))
        with BagWriter(folder) as writer:
            arms = writer.add_topic(TopicInfo("/humans/bodies/ann/arm", ARM_TYPE))
            said = writer.add_topic(TopicInfo("/humans/bodies/ann/prediction", PREDICTION_TYPE))
            for index, sample in enumerate(track.samples()):
                stamp = LATER_NS + round(sample.stamp_ns / speed)
                sample = dataclasses.replace(sample, stamp_ns=stamp)
                writer.write(arms, serialize_message(message_from_sample(sample, "ann")), stamp)
                taken = change(index, sample) if change else sample
                if taken is not None:
                    predictor.observe(taken)
                # As late as ticks are; the last ones long after the samples have ended.
                late = 7_000_000 + (10**9 if index + 4 > len(track) else 0)
                prediction = predictor.predict(stamp + late) if index % every == 0 else None
                if prediction is not None:
                    name = str(library) if named is None else named
                    message = message_from_prediction(prediction, "ann", name)
                    writer.write(said, serialize_message(message), stamp + late)
            writer.close()
        return folder

    return write


def compared(*args, **kwargs) -> Comparison:
    (found,) = compare_bags(*args, **kwargs)
    return found


def test_a_replay_says_the_same_as_offline(live, source: Path, track: ArmTrack) -> None:
    folder = live()
    for found in (compared(folder, source), compared(folder)):
        assert found.same
        assert found.body == "ann"
        assert found.samples == found.recorded == len(track)
        assert found.predictions == len(range(0, len(track), 2))
        assert found.reaching > 20
        assert found.invalid >= 2
        assert found.largest == (0.0,) * 4
        assert found.first_s is None


def test_both_arms_of_a_body_are_compared_each_by_itself(
    tmp_path: Path, track: ArmTrack, library: Path
) -> None:
    sides = {"left", "right"}
    predictors = {side: ReachPredictor(TaskLibrary.load(library)) for side in sorted(sides)}
    with BagWriter(tmp_path / "both") as writer:
        arms = writer.add_topic(TopicInfo("/humans/bodies/ann/arm", ARM_TYPE))
        said = writer.add_topic(TopicInfo("/humans/bodies/ann/prediction", PREDICTION_TYPE))
        for sample in track.samples():
            for side, predictor in predictors.items():
                own = dataclasses.replace(sample, side=side, stamp_ns=sample.stamp_ns + LATER_NS)
                message = message_from_sample(own, "ann")
                writer.write(arms, serialize_message(message), own.stamp_ns)
                predictor.observe(own)
                if (prediction := predictor.predict()) is not None:
                    message = message_from_prediction(prediction, "ann", str(library))
                    writer.write(said, serialize_message(message), own.stamp_ns)
    found = compare_bags(tmp_path / "both")
    assert [item.body for item in found] == ["ann left", "ann right"]
    for item in found:
        assert item.same
        assert item.samples == item.recorded == len(track)
        assert item.reaching > 20
    offline = list(predict_bag(tmp_path / "both"))
    assert {(body, prediction.side) for body, prediction in offline} == {
        ("ann", side) for side in sides
    }


def test_only_a_reach_has_an_onset(live, track: ArmTrack) -> None:
    predictions = recorded_predictions(BagReader(live()))["ann", track.side].predictions
    assert {p.state for p in predictions} == set(ReachState)
    for prediction in predictions:
        assert prediction.task_probabilities.sum() == pytest.approx(1.0)
        if prediction.state is ReachState.REACHING:
            assert 0 < prediction.onset_ns < prediction.stamp_ns
            assert prediction.duration_mean_s > 0.0
        else:
            assert prediction.onset_ns == 0
            assert prediction.duration_mean_s == prediction.duration_std_s == 0.0
    # What is said while idle are the tasks' shares before any sample.
    prior = [p.task_probabilities for p in predictions if p.state is not ReachState.REACHING]
    np.testing.assert_array_equal(prior, np.broadcast_to(prior[0], np.shape(prior)))


def test_an_onset_while_idle_gives_it_away(live, source: Path, monkeypatch) -> None:
    said = ReachPredictor.predict

    def wrong(self: ReachPredictor, now_ns: int | None = None) -> Prediction | None:
        found = said(self, now_ns)
        return found and dataclasses.replace(found, onset_ns=found.onset_ns or found.stamp_ns)

    with monkeypatch.context() as patched:
        patched.setattr(ReachPredictor, "predict", wrong)
        folder = live()
    found = compared(folder, source)
    assert found.different == found.predictions - found.reaching


def test_what_the_predictor_did_not_get_gives_it_away(live, source: Path, track: ArmTrack) -> None:
    missed = range(80, 84)
    found = compared(live(lambda index, sample: None if index in missed else sample), source)
    assert not found.same
    assert found.strange == 0  # at that time it spoke of the sample before
    assert found.first_s == pytest.approx(track.time_s[missed[-1]] - track.time_s[0], abs=0.05)
    assert found.largest[0] > 1e-6


def test_other_samples_give_it_away(live, source: Path) -> None:
    def later(index: int, sample: ArmSample) -> ArmSample:
        return dataclasses.replace(sample, stamp_ns=sample.stamp_ns + 1)

    found = compared(live(later), source)
    assert found.strange == found.predictions
    assert found.first_s == pytest.approx(0.0, abs=1e-6)


def test_another_library_or_configuration_gives_it_away(live, source: Path, tmp_path: Path) -> None:
    folder = live()
    found = compared(folder, source, config=PredictorConfig(pace_sd=0.08))
    assert found.different > 0
    assert found.largest[0] == 0.0
    assert found.largest[1] > 0.0
    found = compared(folder, source, config=PredictorConfig(horizon=1.0))
    assert found.different == found.predictions
    assert found.largest == (np.inf,) * 4


def test_bags_that_cannot_be_compared_are_refused(
    live, source: Path, tmp_path: Path, library: Path, recordings: list[Recording]
) -> None:
    other = recordings[1].track
    write_arm_bag(tmp_path / "other", other)
    write_arm_bag(tmp_path / "bob", dataclasses.replace(other, subject="bob"))
    with pytest.raises(DataError, match="holds no prediction"):
        compare_bags(source)
    folder = live(speed=2.0)
    with pytest.raises(DataError, match="is not the one in"):
        compare_bags(folder, source)
    with pytest.raises(DataError, match="is not the one in"):
        compare_bags(folder, tmp_path / "other")
    with pytest.raises(DataError, match="bob holds no arm of ann"):
        compare_bags(folder, tmp_path / "bob")
    with pytest.raises(DataError, match=r"library\.npz is no bag"):
        compare_bags(folder, library)


def test_the_library_is_the_one_that_is_named(live, source: Path, library: Path) -> None:
    folder = live(named="/gone/library.npz")
    with pytest.raises(ConfigError, match="--library"):
        compare_bags(folder, source)
    assert compared(folder, source, library).same


def test_bag_in_predictions_out_as_in_the_evaluation(
    source: Path, track: ArmTrack, library: Path
) -> None:
    tasks = TaskLibrary.load(library)
    offline = list(predict_bag(source, tasks))
    assert len(offline) == len(track)
    assert {body for body, _ in offline} == {"ann"}
    at = {p.stamp_ns - START_NS: p for _, p in offline}
    cuts = track.time_s[[40, 75, 110, 148]]
    found, _ = replay(ReachPredictor(tasks), track, cuts.tolist())
    states = set()
    for cut in found:
        evaluated = cut.prediction
        assert evaluated is not None
        states.add(evaluated.state)
        np.testing.assert_array_equal(at[evaluated.stamp_ns].mean, evaluated.mean)
        np.testing.assert_array_equal(at[evaluated.stamp_ns].covariance, evaluated.covariance)
    assert states == {ReachState.IDLE, ReachState.REACHING}


def test_sizes_that_do_not_belong_together_are_refused(
    tmp_path: Path, source: Path, library: Path
) -> None:
    prediction = next(p for _, p in predict_bag(source, TaskLibrary.load(library)))
    message = message_from_prediction(prediction, "ann", "")
    message.mean = message.mean[:-1]
    with BagWriter(tmp_path / "bad") as writer:
        said = writer.add_topic(TopicInfo("/humans/bodies/ann/prediction", PREDICTION_TYPE))
        writer.write(said, serialize_message(message), 1)
    with pytest.raises(DataError, match="12 means"):
        recorded_predictions(BagReader(tmp_path / "bad"))


def test_the_command(live, source: Path, tmp_path: Path) -> None:
    folder = live()
    runner = CliRunner()
    result = runner.invoke(cli.app, [str(folder), "--source", str(source)])
    assert result.exit_code == 0, result.output
    assert "the same as offline" in result.output
    assert "[m²]" in result.output
    (tmp_path / "wide.yaml").write_text("pace_sd: 0.08\n")
    result = runner.invoke(cli.app, [str(folder), "--config", str(tmp_path / "wide.yaml")])
    assert result.exit_code == cli.DIFFERENT
    assert "not the same as offline, first 0." in result.output
