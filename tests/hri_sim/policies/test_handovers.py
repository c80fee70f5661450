"""Handovers of a file that others recorded."""

import os
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_sim.policies.handovers import CHESTS_APART_M, FILE, load_handovers, without_pair
from hri_sim.policies.recordings import load_encounters


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Three handovers of two pairs at 120 Hz: both hands meet half way."""
    share = np.linspace(0.0, 1.0, 121)[:, None]
    giver = (0.2, 0.5, 0.1) * (1.0 - share) + (0.5, 0.5, 0.2) * share
    taker = (0.8, 0.5, 0.1) * (1.0 - share) + (0.5, 0.5, 0.2) * share
    both = np.stack((giver, taker), axis=1)
    np.savez(
        tmp_path / "hands.npz",
        pos=np.concatenate((both, both, both)).astype(np.float32),
        start=[0, 121, 242],
        length=[121, 121, 121],
        pair=[4, 4, 7],
        rate_hz=120.0,
    )
    return tmp_path / "hands.npz"


def test_the_taker_learns_unless_told_otherwise(file: Path) -> None:
    taker, giver = load_handovers(file), load_handovers(file, "giver")
    assert [one.pair for one in taker] == ["4", "4", "7"]
    assert len(taker[0]) == 32  # one second of 32 ms
    scale = (CHESTS_APART_M, CHESTS_APART_M, 1.0)
    np.testing.assert_allclose(taker[0].hand[0], np.multiply((0.8, 0.5, 0.1), scale), atol=0.005)
    np.testing.assert_allclose(taker[0].goal, np.multiply((0.5, 0.5, 0.2), scale), atol=0.01)
    np.testing.assert_array_equal(taker[0].goal, taker[0].hand[-1])
    np.testing.assert_array_equal(giver[0].hand, taker[0].partner)


def test_a_pair_can_be_kept_apart(file: Path) -> None:
    others, those = without_pair(load_handovers(file), "7")
    assert [one.pair for one in others] == ["4", "4"]
    assert [one.pair for one in those] == ["7"]
    with pytest.raises(DataError, match="pair '5'; expected one of 4, 7"):
        without_pair(load_handovers(file), "5")


def test_they_are_known_by_their_content(file: Path) -> None:
    assert [len(load_encounters(file, name)) for name in ("", "giver")] == [3, 3]
    with pytest.raises(DataError, match="nobody is called 'ann'; expected one of giver, taker"):
        load_encounters(file, "ann")


def test_other_files_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", pos=np.zeros(3))
    with pytest.raises(DataError, match=r"cannot read .*other\.npz.*expected pos, start"):
        load_handovers(tmp_path / "other.npz")
    (tmp_path / "broken.npz").write_bytes(b"PK\x03\x04 no archive")
    for name in ("none.npz", "broken.npz"):
        with pytest.raises(DataError, match=f"cannot read .*{name}"):
            load_handovers(tmp_path / name)


@pytest.mark.skipif("HRI_DATA_DIR" not in os.environ, reason="needs the recordings (HRI_DATA_DIR)")
def test_the_recorded_ones_are_as_published() -> None:
    path = Path(os.environ["HRI_DATA_DIR"]) / FILE
    if not path.is_file():
        pytest.skip(f"no {path}")
    found = load_handovers(path)
    assert len(found) == 708
    assert len({one.pair for one in found}) == 8
    ways = np.array([np.linalg.norm(one.goal - one.hand[0]) for one in found])
    assert 0.15 < np.median(ways) < 0.8
    nearest = [np.linalg.norm(one.hand[-1] - one.partner[-1]) for one in found]
    assert np.median(nearest) < 0.6
