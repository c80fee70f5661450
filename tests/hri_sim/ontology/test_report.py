"""Tables of an evaluation."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hri_prediction.ontology.evaluation import FULL, KINDS, Confusion
from hri_sim.ontology.report import least_lines
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT
from hri_sim.ontology.sweep import SPLITS, Swept, draw_sweep, sweep_lines


def test_cases_that_are_recognised_too_seldom_are_named() -> None:
    well = Confusion(np.array([1, 2]), np.array([[90.0, 10.0], [1.0, 1.0]]))
    badly = Confusion(np.array([1, 2]), np.array([[90.0, 10.0], [6.0, 4.0]]))
    text = "\n".join(least_lines({FULL: {RANDOM: badly, SESSIONS: well, SUBJECT: badly}}))
    assert "| half of the recordings left out | 70.0 % | none | met |" in text
    # How hard it is there is set.
    assert "| random halves of segments | 65.0 % | 2 (40.0 %) | set, not judged |" in text
    assert "| one person left out | 65.0 % | 2 (40.0 %) | **missed** |" in text
    assert least_lines({}) == []


def test_a_case_that_was_not_there_is_named_too() -> None:
    none = Confusion(np.array([1, 2]), np.array([[90.0, 10.0], [0.0, 0.0]]))
    text = "\n".join(least_lines({FULL: {SUBJECT: none}}))
    assert "| 90.0 % | 2 (–) | **missed** |" in text


def test_a_jitter_with_too_few_sessions_for_a_split(tmp_path: Path) -> None:
    """As in a smoke run: what cannot be split has no rate, and the rest of the table is there."""
    rates: dict[tuple[str, str], float | None] = {
        (labels, kind): None for labels in KINDS for kind in SPLITS
    }
    few = Swept(0.04, {**rates, (FULL, SUBJECT): 0.5}, 0.75, 0.125, {1: 1.0, 20: 0.5})
    text = "\n".join(sweep_lines([few]))
    assert "| 4 cm | – | – | 50.0 % | – | – | – | 75 % | 12 % |" in text
    assert "1: 100 %, 20: 50 %" in text
    draw_sweep(tmp_path / "sweep.png", [few])
    assert (tmp_path / "sweep.png").stat().st_size > 5_000
