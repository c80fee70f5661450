"""Found against labelled boundaries."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.tracks.boundaries import match_boundaries, overlap, pooled
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.labels import onset_labels, segment_labels, whole_movements
from hri_prediction.tracks.segmentation import Reach, find_reaches

LABELS = [Reach(0.0, 1.0), Reach(2.0, 3.0), Reach(3.0, 4.5)]


def test_shifted_boundaries_are_matched_and_measured():
    found = [Reach(0.1, 1.05), Reach(1.95, 3.1), Reach(6.0, 7.0)]
    errors = match_boundaries(found, LABELS)
    assert (errors.labels, errors.matched, errors.extra) == (3, 2, 1)
    np.testing.assert_allclose(errors.onset_s, [0.1, -0.05])
    np.testing.assert_allclose(errors.end_s, [0.05, 0.1])
    figures = errors.figures()
    assert figures["matched_share"] == pytest.approx(2 / 3)
    assert figures["median_ms"] == pytest.approx(75.0)
    assert figures["p95_ms"] == pytest.approx(100.0)
    assert figures["onset_bias_ms"] == pytest.approx(25.0)
    assert figures["end_bias_ms"] == pytest.approx(75.0)


def test_a_label_is_matched_once():
    halves = [Reach(0.0, 0.6), Reach(0.6, 1.0)]
    errors = match_boundaries(halves, LABELS[:1])
    assert (errors.matched, errors.extra) == (1, 1)
    np.testing.assert_allclose(errors.end_s, [-0.4])


def test_a_reach_over_two_labels_belongs_to_the_larger():
    errors = match_boundaries([Reach(2.0, 4.5)], LABELS)
    assert errors.matched == 1
    np.testing.assert_allclose(errors.onset_s, [-1.0])


def test_nothing_found_and_nothing_labelled():
    nothing = match_boundaries([], LABELS)
    assert (nothing.matched, nothing.extra) == (0, 0)
    assert nothing.figures()["median_ms"] is None
    assert nothing.figures()["matched_share"] == 0.0
    unlabelled = match_boundaries(LABELS, [])
    assert (unlabelled.matched, unlabelled.extra) == (0, 3)
    assert unlabelled.figures()["matched_share"] is None


def test_recordings_are_pooled():
    one, two = match_boundaries(LABELS, LABELS), match_boundaries(LABELS[:1], LABELS[:2])
    both = pooled([one, two])
    assert (both.labels, both.matched, both.extra) == (5, 4, 0)
    assert both.figures()["p95_ms"] == 0.0
    assert pooled([]).labels == 0


SPANS = st.tuples(st.floats(0.0, 10.0), st.floats(0.01, 5.0)).map(
    lambda s: Reach(s[0], s[0] + s[1])
)


@given(SPANS, SPANS)
def test_overlap_is_a_symmetric_share(a, b):
    assert overlap(a, b) == overlap(b, a)
    assert 0.0 <= overlap(a, b) <= 1.0
    assert overlap(a, a) == 1.0


def run_arrays(**changes):
    """Two short runs of the pick-and-place marker set, the hand of the second moving."""
    names = ["Shoulder", "Elbow", "Hand top", "Hand right", "Hand left", "Index"]
    rest = np.array(
        [[0, 0, 0.4], [0, 0, 0.1], [0, -0.3, 0.1], [0.02, -0.25, 0.1], [-0.02, -0.25, 0.1],
         [0, -0.4, 0.1]]
    )  # fmt: skip
    pos = np.tile(rest, (300, 1, 1))
    z = np.clip((np.arange(200) - 60) / 60, 0.0, 1.0)
    way = 0.3 * z**3 * (10 - 15 * z + 6 * z**2)
    pos[100:, 2:] += way[:, None, None] * np.array([1.0, 0.0, 0.0])
    arrays = {
        "pos": pos.astype(np.float32),
        "marker_names": np.array(names),
        "rate_hz": np.array(60.0),
        "subject": np.array([1, 2]),
        "run": np.array([1, 4]),
        "start": np.array([0, 100]),
        "length": np.array([100, 200]),
        "segment": np.array([[1, 60, 120], [1, 60, 90], [1, 0, 60]]),
        "segment_label": np.array(["approach", "approach_part", "idle"]),
    }
    return {name: value for name, value in (arrays | changes).items() if value is not None}


def test_runs_come_with_their_labels(tmp_path):
    path = tmp_path / "any.npz"
    np.savez(path, **run_arrays())
    tracks, labels = load_tracks(path), segment_labels(path)
    assert [(t.subject, t.trial, len(t)) for t in tracks] == [
        ("subject1", 1, 100),
        ("subject2", 4, 200),
    ]
    np.testing.assert_allclose(tracks[0].keypoints[0, 2], [0.0, -0.22, 0.1], atol=1e-6)
    assert labels is not None
    assert labels[0] == []
    assert whole_movements(labels[1]) == [Reach(1.0, 2.0)]
    found = find_reaches(tracks[1].time_s, tracks[1].keypoints[:, 2])
    errors = match_boundaries(found, whole_movements(labels[1])).figures()
    assert errors["matched"] == 1
    assert errors["p95_ms"] < 150.0
    assert onset_labels(path) is None


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"rate_hz": None}, "rate_hz is missing"),
        ({"rate_hz": np.array(0.0)}, "rate_hz"),
        ({"pos": np.zeros((300, 5, 3))}, "pos is"),
        ({"subject": np.array([1.0, 2.0])}, "subject is"),
        ({"length": np.array([100, 300])}, "run 1|trial 1"),
        ({"marker_names": np.array(["a", "b", "c", "d", "e", "f"])}, "marker"),
    ],
)
def test_malformed_runs_are_refused(tmp_path, changes, problem):
    np.savez(tmp_path / "runs.npz", **run_arrays(**changes))
    with pytest.raises(DataError, match=problem):
        load_tracks(tmp_path / "runs.npz")


def test_labels_of_onsets(tmp_path):
    arrays = {
        "pos": np.zeros((20, 4, 3)),
        "joint_names": np.array(["shoulder", "elbow", "wrist", "fingertip"]),
        "onset": np.array([3]),
        "offset": np.array([8]),
    }
    np.savez(tmp_path / "reach.npz", **arrays)
    assert onset_labels(tmp_path / "reach.npz") == [Reach(0.0, 0.05)]
    assert segment_labels(tmp_path / "reach.npz") is None
    np.savez(tmp_path / "wrong.npz", **(arrays | {"offset": np.array([3])}))
    with pytest.raises(DataError, match="trial 0 lasts 0 s"):
        onset_labels(tmp_path / "wrong.npz")
    (tmp_path / "text.csv").write_text("time_s\n")
    assert onset_labels(tmp_path / "text.csv") is None
    assert onset_labels(tmp_path) is None
    (tmp_path / "cut.npz").write_bytes((tmp_path / "reach.npz").read_bytes()[:500])
    for labels in (onset_labels, segment_labels):
        with pytest.raises(DataError, match=r"cannot read .*cut\.npz"):
            labels(tmp_path / "cut.npz")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"segment": np.array([[2, 1, 5]])}, "a segment of run 2 at 60 Hz; expected runs 0 to 1"),
        ({"segment": np.array([[-1, 1, 5]])}, "a segment of run -1"),
        ({"segment": np.array([[0, 1]])}, r"segment is int64 \(1, 2\); expected numbers \(1, 3\)"),
        ({"segment_label": np.array([3])}, "segment_label is int64"),
        ({"rate_hz": np.array("x")}, "rate_hz is .*; expected one number"),
    ],
)
def test_labels_of_segments_that_are_none(tmp_path, changes, match):
    segments = {"segment": np.array([[0, 1, 5]]), "segment_label": np.array(["grasp"])}
    arrays = run_arrays(**segments)
    np.savez(tmp_path / "runs.npz", **arrays)
    assert segment_labels(tmp_path / "runs.npz") == [[("grasp", Reach(1 / 60, 5 / 60))], []]
    np.savez(tmp_path / "wrong.npz", **(arrays | changes))
    with pytest.raises(DataError, match=match):
        segment_labels(tmp_path / "wrong.npz")


def test_runs_as_arrays_are_the_exported_ones():
    folder = os.environ.get("HRI_DATA_DIR")
    if not folder:
        pytest.skip("HRI_DATA_DIR is not set")
    path = Path(folder) / "pickplace_dfki_qualisys"
    if not (path / "runs.npz").is_file():
        pytest.skip("HRI_DATA_DIR holds no pickplace_dfki_qualisys/runs.npz")
    run = load_tracks(path / "runs.npz")[2]
    text = load_tracks(path / "original" / "subject1_run3.tsv")[0]
    assert (run.subject, run.trial, run.side) == (text.subject, text.trial, text.side)
    np.testing.assert_allclose(run.keypoints, text.keypoints, atol=1e-6)
    assert len(run) == len(text)
