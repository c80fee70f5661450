"""``scripts/fit_ioc.py --law --whole`` on recorded people: the law that they have comes out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.motor_control.cli import main
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.law import WeightLaw, explained
from hri_prediction.tracks.files import save_tracks
from hri_sim.motor_control.people import draw_people, record

PAIRS = [(number // 9, number % 9) for number in range(0, 81, 4)]


def test_the_law_of_a_person_is_found_in_their_recordings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the noise of good motion capture, twice each; nobody says when they begin and end."""
    rng = np.random.default_rng(11)
    (person,) = draw_people(1, rng)
    recorded = [
        record(person, start, target, rng, repetitions=2, noise_m=0.001) for start, target in PAIRS
    ]
    save_tracks(tmp_path / "reaches.npz", [track for each in recorded for track in each.tracks])
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(tmp_path / "out"), "--facing", "90"]
    assert main([*arguments, "--law", "--whole"]) == 0, capsys.readouterr().err
    content = json.loads((tmp_path / "out" / "results.json").read_text())
    (law,) = content["laws"]
    assert law["reaches"] == 2 * len(PAIRS)
    found = WeightLaw(CHAPTER_2, np.array(law["theta"]))
    seen = [np.radians([row["q_start_deg"], row["q_end_deg"]]) for row in content["reaches"][::2]]
    share = explained([each.alpha for each in recorded], [found.alpha(*ends) for ends in seen])
    print(f"R² to the true weights {share:.3f}")
    assert share > 0.9
