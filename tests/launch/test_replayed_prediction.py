"""A bag of a recording replayed through the live predictor says what the predictor says offline."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from terminals import Terminals, block, recipe, wait_for

from hri_prediction.bags.arms import arm_samples
from hri_prediction.bags.predictions import recorded_predictions
from hri_prediction.bags.reader import BagReader
from hri_prediction.evaluation.comparison import predict_bag
from hri_prediction.prediction import Prediction, ReachState, TaskLibrary
from hri_prediction.prediction.training import train
from hri_prediction.ros.arm_bag import body_id_of, write_arm_bag
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.seating import suggest_placement

HEADING = "## A recording through the live predictor"
IMPORT, TRAIN, PREDICTOR, RECORDER, REPLAY, COMPARE = recipe("docs/recordings.md", HEADING)
SOURCE, PREDICTED, LIBRARY = "runs/reach_bag", "runs/predicted", "runs/library/library.npz"
PERIOD_S = 0.02
T = TypeVar("T")


def replay(terminals: Terminals) -> str:
    """The recipe from the first node on; what the comparison says."""
    nodes = [terminals.start(PREDICTOR), terminals.start(RECORDER)]
    for node in nodes:
        wait_for(node, "ready")
    terminals.run(REPLAY)
    terminals.end()
    assert [node.returncode for node in nodes] == [0, 0]
    return terminals.run(COMPARE)


def check(folder: Path, body: str) -> dict[ReachState, int]:
    """Each live prediction is one made offline from the samples of the first bag, by its stamp.

    Returns:
        Number of live predictions by their state.
    """
    (source,) = _of(body, arm_samples(BagReader(folder / SOURCE)))
    live = BagReader(folder / PREDICTED)
    (played,) = _of(body, arm_samples(live))
    assert len(played) == len(source)
    shift = played[0].stamp_ns - source[0].stamp_ns
    offline: dict[int, list[Prediction]] = defaultdict(list)
    for _, prediction in predict_bag(folder / SOURCE, TaskLibrary.load(folder / LIBRARY)):
        offline[prediction.stamp_ns + shift].append(prediction)
    counts = dict.fromkeys(ReachState, 0)
    (recorded,) = _of(body, recorded_predictions(live))
    for found in recorded.predictions:
        counts[found.state] += 1
        if found.state is ReachState.INVALID:
            continue  # the clock says so, of samples that have ended
        # After a sample of which nothing could be used the newest one used is still the one before.
        assert any(same(found, expected, shift) for expected in offline[found.stamp_ns])
    valid = counts[ReachState.IDLE] + counts[ReachState.REACHING]
    # A busy machine may drop ticks.
    assert valid > 0.7 * (source[-1].stamp_ns - source[0].stamp_ns) * 1e-9 / PERIOD_S
    return counts


def _of(body: str, arms: Mapping[tuple[str, str], T]) -> list[T]:
    """What there is of the arms of a body."""
    return [found for (whose, _), found in arms.items() if whose == body]


def same(found: Prediction, expected: Prediction, shift: int) -> bool:
    """Whether all that they say is the same, numbers to 1e-9."""
    return (found.state, found.reason, found.side, found.task_names) == (
        expected.state,
        expected.reason,
        expected.side,
        expected.task_names,
    ) and all(
        np.allclose(a, b, rtol=0.0, atol=1e-9)
        for a, b in (
            (found.times_s, expected.times_s),
            (found.mean, expected.mean),
            (found.covariance, expected.covariance),
            (found.onset_ns, expected.onset_ns + shift if expected.onset_ns else 0),
            (found.duration_mean_s, expected.duration_mean_s),
            (found.duration_std_s, expected.duration_std_s),
            (found.task_probabilities, expected.task_probabilities),
        )
    )


def test_the_recipe_for_a_simulated_recording(
    terminals: Terminals, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    terminals.run(IMPORT)
    terminals.run(TRAIN)
    assert "the same as offline" in replay(terminals)
    counts = check(terminals.folder, "ann")
    assert counts[ReachState.REACHING] > 25
    assert counts[ReachState.IDLE] > 25
    monkeypatch.chdir(terminals.folder)
    exec(block("docs/recordings.md", HEADING, "python"), {})
    assert len(capsys.readouterr().out.splitlines()) == 200
    (recorded,) = _of("ann", recorded_predictions(BagReader(terminals.folder / PREDICTED)))
    (library,) = recorded.libraries
    assert library == LIBRARY
    assert [t.name for t in TaskLibrary.load(terminals.folder / LIBRARY).tasks] == ["cup"]


@pytest.mark.skipif(not os.environ.get("HRI_DATA_DIR"), reason="HRI_DATA_DIR is not set")
def test_a_recording_of_a_person(terminals: Terminals) -> None:
    place = Path(os.environ["HRI_DATA_DIR"]) / "pickplace_dfki_qualisys" / "original"
    seen, *others = [
        track.transformed(suggest_placement(track))
        for number in (3, 1, 2)
        for track in load_tracks(place / f"subject2_run{number}.tsv")
    ]
    # The last seconds, in which the hand tip is lost twice.
    write_arm_bag(terminals.folder / SOURCE, seen.slice(seen.time_s[-1] - 4.0, seen.time_s[-1]))
    (terminals.folder / LIBRARY).parent.mkdir()
    train(others, group_by="movement").library.save(terminals.folder / LIBRARY)
    assert "the same as offline" in replay(terminals)
    counts = check(terminals.folder, body_id_of(seen.subject))
    assert counts[ReachState.REACHING] > 50
