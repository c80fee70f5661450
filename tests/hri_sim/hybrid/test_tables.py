"""Figures of the report."""

from __future__ import annotations

import pytest

from hri_prediction.hybrid.config import HybridConfig
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL, STRAIGHT
from hri_sim.hybrid.report import _settled
from hri_sim.hybrid.scores import Calibration
from hri_sim.hybrid.tables import by_person, curves, reaches_until_settled
from hri_sim.hybrid.trial import Judged

SURE = Calibration(0.0, 0.5, 0.95)


def judged(person: str, target: str, guess: str, seen: int, warped_m: float) -> Judged:
    return Judged(person, target, guess, seen, warped_m, 0.0, 0.0, 0.0, SURE, SURE)


def test_tasks_settle_by_the_rule_of_the_loop() -> None:
    config = HybridConfig()
    least = config.settled_reaches
    low, high = 0.5 * config.settled, 2.0 * config.settled
    early = [low] * (least + 3)  # from the first on, but fewer reaches settle nothing
    late = [high] * (least + 1) + [low, high]
    found = reaches_until_settled([early, late, [high] * 40])
    assert found == {"tasks": 3, "settled": 2, "median": least + 1.0, "most": least + 2}
    assert _settled(found) == f"{least + 1}; {least + 2}, 2 of 3"
    assert _settled(reaches_until_settled([[high]])) == "none of 1 tasks"


def test_errors_of_single_people_are_means_over_their_targets() -> None:
    rows = [
        judged("a", "T1", OPTIMAL, 0, 0.01),
        judged("a", "T3", OPTIMAL, 0, 0.03),
        judged("b", "T1", OPTIMAL, 0, 0.05),
        judged("a", "T1", STRAIGHT, 0, 0.9),
        judged("a", "T1", OPTIMAL, 5, 0.01),
        judged("b", "T1", OPTIMAL, 5, 0.02),
    ]
    found = by_person(rows, OPTIMAL)
    assert found["0"] == pytest.approx([2.0, 5.0])
    assert found["5"] == pytest.approx([1.0, 2.0])


def test_errors_of_the_file_of_results_are_centimetres_and_called_so() -> None:
    rows = [
        Judged("a", target, guess, 0, 0.01, 0.02, 0.03, 0.04, SURE, SURE)
        for guess in GUESSES
        for target in ("T1", "T3")
    ]
    assert curves(rows)[OPTIMAL] == {
        "warped_cm": {"0": pytest.approx(1.0)},
        "end_cm": {"0": pytest.approx(2.0)},
        "untold_cm": {"0": pytest.approx(3.0)},
        "untold_end_cm": {"0": pytest.approx(4.0)},
    }
