"""Who learns from whom, that nothing of the future is used, and that work is kept and shared."""

import dataclasses
import importlib.util

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.evaluation import run
from hri_prediction.evaluation.folds import (
    LEAVE_ONE_OUT,
    NEW_TASK,
    OURS,
    WITHIN,
    Learnt,
    Moment,
    Settings,
    evaluate_fold,
    make_folds,
    training,
)
from hri_prediction.evaluation.replay import replay
from hri_prediction.prediction import PredictorConfig
from hri_prediction.warm import warm_kernels

HAS_REFERENCE = importlib.util.find_spec("movement_primitives") is not None


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    warm_kernels()


def settings_for(protocol: str, **values) -> Settings:
    given = {"observed": (0.3, 0.6), "references": HAS_REFERENCE, "group_by": "task"} | values
    return Settings(protocol=protocol, config=PredictorConfig(), **given)


def test_within_learns_from_the_others_of_the_same_person(recordings):
    folds, skipped = make_folds(recordings, WITHIN)
    assert [len(fold.tests) for fold in folds] == [6, 6]
    assert skipped == []
    for test in range(len(recordings)):
        known = training(recordings, test, WITHIN)
        assert len(known) == 5
        assert all(r is not recordings[test] for r in known)
        assert {r.track.subject for r in known} == {recordings[test].track.subject}


def test_leaving_a_subject_out_leaves_all_of_it_out(recordings):
    folds, _ = make_folds(recordings, LEAVE_ONE_OUT)
    assert [len(fold.tests) for fold in folds] == [6, 6]
    for test in range(len(recordings)):
        known = training(recordings, test, LEAVE_ONE_OUT)
        assert len(known) == 6
        assert recordings[test].track.subject not in {r.track.subject for r in known}


def test_leaving_a_task_out_leaves_it_out_of_everybody(recordings):
    folds, skipped = make_folds(recordings, NEW_TASK)
    assert [len(fold.tests) for fold in folds] == [3, 3, 3, 3]
    assert skipped == []
    for fold in folds:
        known = [training(recordings, test, NEW_TASK) for test in fold.tests]
        assert all(len(found) == 3 for found in known)
        own = recordings[fold.tests[0]].track
        assert {r.track.task for found in known for r in found}.isdisjoint({own.task})
        assert {r.track.subject for found in known for r in found}.isdisjoint({own.subject})
        # A fold learns once: all of its recordings must learn from the same ones.
        assert all(found == known[0] for found in known)


def test_a_left_out_task_is_in_no_library_and_told_to_nobody(recordings):
    settings = settings_for(NEW_TASK, references=False)
    assert not [name for name in settings.predictors if name.endswith("_told_task")]
    fold = make_folds(recordings, NEW_TASK)[0][0]
    cells = evaluate_fold(recordings, fold, settings)
    assert np.isfinite(cells["belief/0.6"][:, 0]).all()
    assert np.isnan(cells["belief/0.6"][:, 1]).all()


def test_without_names_no_task_can_be_left_out(recordings):
    nameless = [
        dataclasses.replace(r, track=dataclasses.replace(r.track, task="")) for r in recordings
    ]
    with pytest.raises(DataError, match="two tasks"):
        make_folds(nameless, NEW_TASK)


def test_the_other_side_and_those_who_do_not_teach_are_not_learnt_from(recordings):
    other = dataclasses.replace(
        recordings[1], track=dataclasses.replace(recordings[1].track, side="left")
    )
    assert other not in training([recordings[0], other, recordings[2]], 0, WITHIN)
    pupils = [dataclasses.replace(r, teaches=r.track.subject == "ann") for r in recordings]
    with pytest.raises(DataError, match="two recordings"):
        make_folds([recordings[0]], WITHIN)
    folds, skipped = make_folds(pupils, LEAVE_ONE_OUT)
    assert len(folds) == 1
    assert "ann" in skipped[0]


def test_who_is_not_judged_is_not_predicted(recordings):
    some = [dataclasses.replace(r, judged=r.track.subject == "ann") for r in recordings]
    folds, skipped = make_folds(some, LEAVE_ONE_OUT)
    assert [some[i].track.subject for fold in folds for i in fold.tests] == ["ann"] * 6
    assert skipped == []


def test_nobody_to_learn_from_is_an_error(recordings):
    with pytest.raises(DataError, match="two subjects"):
        make_folds([r for r in recordings if r.track.subject == "ann"], LEAVE_ONE_OUT)


def test_nothing_from_the_future_is_used(recordings):
    """What comes after the cut is shuffled: no forecast of any predictor changes by a bit."""
    settings = settings_for(WITHIN)
    test = recordings[0]
    learnt = Learnt(training(recordings, 0, WITHIN), settings)
    reach = test.reaches[0]
    cut = reach.onset_s + 0.4 * reach.duration_s
    points = np.array(test.track.keypoints)
    later = np.flatnonzero(test.track.time_s > cut)
    points[later] = points[np.random.default_rng(0).permutation(later)]
    shuffled = dataclasses.replace(
        test, track=dataclasses.replace(test.track, keypoints=points), found=()
    )
    assert not np.array_equal(points, test.track.keypoints)
    times = cut + np.linspace(0.05, 0.6, 12)
    said = []
    for recording in (test, shuffled):
        ours, _ = replay(learnt.ours, recording.track, [cut])
        plain, _ = replay(learnt.constant_velocity, recording.track, [cut])
        moment = Moment(recording, reach, ours[0], plain[0])
        said.append([moment.forecaster(name, learnt)(times) for name in settings.predictors])
        assert moment.ours.now_s <= cut
    assert len(said[0]) == len(settings.predictors)
    for one, other in zip(*said, strict=True):
        np.testing.assert_array_equal(one.mean, other.mean)
        np.testing.assert_array_equal(one.covariance, other.covariance)
        assert np.isfinite(one.mean).all()


def test_several_cuts_in_one_pass_are_those_of_single_passes(recordings):
    learnt = Learnt(training(recordings, 0, WITHIN), settings_for(WITHIN))
    track = recordings[0].track
    together, spans = replay(learnt.ours, track, [-0.1, 0.3, 0.7, 9.0])
    assert len(spans) > 10
    for cut, time in zip(together, (-0.1, 0.3, 0.7, 9.0), strict=True):
        alone = replay(learnt.ours, track, [time])[0][0]
        assert cut.now_s == alone.now_s == track.time_s[track.time_s <= time + 5e-7][-1]
        np.testing.assert_array_equal(cut.prediction.mean, alone.prediction.mean)
    assert together[0].onset_s is None
    assert together[1].onset_s == pytest.approx(0.05, abs=0.05)


def test_a_task_is_found_when_it_is_the_likeliest(recordings):
    learnt = Learnt(training(recordings, 0, WITHIN), settings_for(WITHIN))
    track = recordings[0].track
    cut = replay(learnt.ours, track, [0.3])[0][0]
    names = cut.prediction.task_names

    def right(probabilities, task):
        said = dataclasses.replace(cut.prediction, task_probabilities=np.array(probabilities))
        return dataclasses.replace(cut, prediction=said).belief(1.0, task)[1]

    assert len(names) == 3
    assert names[2] == "unknown"
    assert right([0.45, 0.35, 0.2], names[0]) == 1.0  # less than half, and yet the likeliest
    assert right([0.35, 0.45, 0.2], names[0]) == 0.0
    assert right([0.3, 0.2, 0.5], names[0]) == 0.0
    assert np.isnan(right([0.45, 0.35, 0.2], "never seen"))
    error = cut.belief(1.0, names[0])[0]
    assert error == pytest.approx(cut.prediction.duration_mean_s - 1.0)
    rest = replay(learnt.ours, track, [-0.1])[0][0]
    assert np.isnan(rest.belief(1.0, names[0])).all()


def test_a_cut_before_the_first_sample_knows_nothing(recordings):
    learnt = Learnt(training(recordings, 0, WITHIN), settings_for(WITHIN))
    cut = replay(learnt.ours, recordings[0].track, [-1.0])[0][0]
    assert cut.prediction is None
    assert np.isnan(cut.forecast(np.zeros(2)).mean).all()


def cells_without_latency(evaluation: run.Evaluation) -> dict[str, np.ndarray]:
    return {k: v for k, v in evaluation.cells.items() if not k.endswith("latency")}


def test_results_do_not_depend_on_the_number_of_workers(recordings, tmp_path):
    settings = settings_for(LEAVE_ONE_OUT, references=False)
    one = run.evaluate(recordings, settings, tmp_path / "one", workers=1)
    two = run.evaluate(recordings, settings, tmp_path / "two", workers=2)
    assert one.cells.keys() == two.cells.keys()
    for name, values in cells_without_latency(one).items():
        np.testing.assert_array_equal(values, two.cells[name])


def test_what_is_done_is_not_done_again(recordings, tmp_path, monkeypatch):
    settings = settings_for(LEAVE_ONE_OUT, references=False, observed=(0.3,))
    worked = []

    def counted(given, fold, chosen):
        worked.append(fold.key)
        return evaluate_fold(given, fold, chosen)

    monkeypatch.setattr(run, "evaluate_fold", counted)
    seen = []
    first = run.evaluate(
        recordings, settings, tmp_path, progress=lambda done, of: seen.append((done, of))
    )
    assert worked == ["000", "001"]
    assert seen == [(0, 2), (1, 2), (2, 2)]
    (tmp_path / "000.npz").write_bytes(b"broken off")
    again = run.evaluate(recordings, settings, tmp_path)
    assert worked == ["000", "001", "000"]
    for name, values in cells_without_latency(first).items():
        np.testing.assert_array_equal(values, again.cells[name])
    other = dataclasses.replace(settings, config=PredictorConfig(pace_sd=0.2))
    run.evaluate(recordings, other, tmp_path)
    run.evaluate(recordings[:-1], other, tmp_path)
    assert worked[3:] == ["000", "001"] * 2


def test_summary_has_all_figures(recordings, tmp_path):
    settings = settings_for(WITHIN)
    results = run.evaluate(recordings, settings, tmp_path).summary()
    assert results["n"] == 12
    assert results["observed"] == 0.3
    assert set(results["predictors"]) == set(settings.predictors) == set(results["knows"])
    assert set(results["by_observed"]) == {"0.3", "0.6"}
    ours = results["predictors"][OURS]
    assert ours["n"] == 12
    later = results["by_observed"]["0.6"][OURS]
    assert later["endpoint_error_m"]["median"] < 0.04
    assert set(ours["error_at_horizon_m"]) == {"0.1", "0.2", "0.5"}
    assert 0.0 < ours["coverage50"] <= ours["coverage95"] <= 1.0
    assert ours["latency_us"] > 0.0
    # Told everything, the mean of a person's reaches to this target cannot be far off.
    assert results["predictors"]["mean_trajectory_told_task"]["endpoint_error_m"]["median"] < 0.03
    assert results["predictors"]["constant_velocity"]["endpoint_error_m"]["median"] > 0.05
    assert results["noticed"]["0.3"] == 1.0
    assert results["duration_error_s"]["0.6"]["median"] < 0.06
    assert results["task_found"]["0.6"] > 0.8
    assert results["skipped"] == [] or not HAS_REFERENCE


def test_without_the_reference_package_its_row_is_skipped(recordings, tmp_path):
    settings = settings_for(LEAVE_ONE_OUT, references=False, observed=(0.5,), group_by="movement")
    evaluation = run.evaluate(recordings[:1] + recordings[-1:], settings, tmp_path)
    results = evaluation.summary()
    assert not [name for name in results["predictors"] if "movement_primitives" in name]
    assert "not installed" in results["skipped"][-1]
    # Without names of tasks, nobody can be told one.
    assert not [name for name in results["predictors"] if name.endswith("told_task")]
    assert results["observed"] == 0.5
