"""Tables of an evaluation."""

from __future__ import annotations

import numpy as np

from hri_prediction.ontology.evaluation import FULL, Confusion
from hri_sim.ontology.report import least_lines
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT


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
