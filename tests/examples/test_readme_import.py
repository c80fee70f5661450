"""The import that the README shows runs as it stands there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np

from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.importers import cli
from hri_prediction.tracks.placement import Placement

ROOT = Path(__file__).resolve().parents[2]


def test_import_of_the_readme(tmp_path: Path, monkeypatch) -> None:
    text = (ROOT / "README.md").read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line.startswith("scripts/import_mocap.py ")]
    words = [shlex.split(line, comments=True)[1:] for line in lines]
    given = next(each for each in words if "--map" in each)
    out = tmp_path / "reach.npz"
    given[given.index("--out") + 1] = str(out)
    monkeypatch.chdir(ROOT)
    # Without --yes: nothing in it is a guess.
    assert cli.main(given) == 0
    (track,) = load_tracks(out)
    assert (track.task, track.side, len(track)) == ("cup", "right", 200)
    # The placement that the README replays it with puts the person where they were simulated.
    (place,) = re.findall(r"replay_mocap.py runs/reach.npz --place (\S+)", text)
    placed = track.transformed(Placement.parse(place))
    shoulder = np.nanmedian(placed.keypoints[:, 0], axis=0)
    np.testing.assert_allclose(shoulder, [0.75, 0.0, 0.4], atol=2e-3)
