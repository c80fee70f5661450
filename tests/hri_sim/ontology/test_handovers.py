"""Two real people who hand something over, where their recording is there."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.shipped import SHIPPED
from hri_sim.ontology import handovers

BODIES = ("chest", *handovers.ARM)


def skeletons(path: Path, **changes: object) -> Path:
    """A file like that of KTH: two people whose right arms swing."""
    time_s = np.arange(600) / 120.0
    places = np.zeros((1, 600, 2, 4, 3))
    for person in range(2):
        angle = 1.2 * np.sin(2.0 * time_s + person)
        for body, height in enumerate((1.2, 1.3, 1.05, 0.8)):
            places[0, :, person, body] = (person, 0.0, height)
        places[0, :, person, 3, 1:] = places[0, :, person, 2, 1:]
        places[0, :, person, 3, 1] += 0.25 * np.sin(angle)
        places[0, :, person, 3, 2] -= 0.25 * np.cos(angle)
    arrays = {
        "pos": places, "body_names": np.array(BODIES), "person_names": np.array(["giver", "taker"]),
        "rate_hz": np.array(120.0),
    }  # fmt: skip
    np.savez(path, **{**arrays, **changes})
    return path


def test_arms_are_found_by_name(tmp_path: Path) -> None:
    ((giver, taker),) = handovers.load_skeletons(skeletons(tmp_path / "s.npz"))
    assert (giver.subject, taker.subject) == ("giver", "taker")
    np.testing.assert_allclose(giver.keypoints[0, :2], [[0.0, 0.0, 1.3], [0.0, 0.0, 1.05]])
    hands = np.linalg.norm(np.diff(giver.keypoints[:, 2:], axis=1), axis=2)
    np.testing.assert_allclose(hands, handovers.HAND_M)


def test_every_movement_is_in_the_table(tmp_path: Path) -> None:
    trials = handovers.load_skeletons(skeletons(tmp_path / "s.npz"))
    found = handovers.label(trials, InteractionClassifier.load(SHIPPED))
    assert {one.who for one in found} == {"giver", "taker"}
    text = "\n".join(handovers.handover_lines(found))
    assert text.count("| 1 | giver |") + text.count("| 1 | taker |") == len(found)
    assert "unlike what was learnt" in text  # they stand a metre apart


def test_costs_are_learnt_from_skeletons(tmp_path: Path) -> None:
    trials = handovers.load_skeletons(skeletons(tmp_path / "s.npz"))
    found = handovers.learn_handovers(trials, 0)
    assert len(found) == handovers.DRAWS
    assert found[0].movements > 2
    assert all(np.isfinite(one.weights).all() for one in found)
    text = "\n".join(handovers.cost_lines(found))
    assert f"| draw 1 | {found[0].movements} |" in text
    assert "Cosine of the nearness" in text
    with pytest.raises(DataError, match="demonstrations"):
        handovers.learn_handovers([], 0)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"body_names": np.array(["a", "b", "c", "d"])}, "bodies a, b, c, d"),
        ({"pos": np.zeros((1, 5, 2, 3))}, r"pos float64 \(1, 5, 2, 3\)"),
        ({"rate_hz": np.array([1.0, 2.0])}, "s.npz: rate_hz"),
        ({"rate_hz": np.array(0.0)}, "rate_hz = 0.0"),
        ({"person_names": np.array(["giver"])}, "1 persons"),
    ],
)
def test_other_files_are_refused(changes: dict[str, np.ndarray], said: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=said):
        handovers.load_skeletons(skeletons(tmp_path / "s.npz", **changes))


def test_the_real_ones() -> None:
    folder = os.environ.get("HRI_DATA_DIR", "")
    file = Path(folder) / handovers.FILE
    if not folder or not file.is_file():
        pytest.skip("HRI_DATA_DIR is not set, or has no handovers")
    found = handovers.label(handovers.load_skeletons(file), InteractionClassifier.load(SHIPPED))
    assert len(found) >= 10
    assert any(one.reason for one in found)
