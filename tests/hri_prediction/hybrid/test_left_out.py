"""Errors of weights are of what was not learnt from: a person's other reaches do not give theirs away."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hri_prediction.hybrid.left_out import by_person, people_left_out, reaches_left_out, whose
from hri_prediction.hybrid.of_laws import data_of_laws
from hri_prediction.hybrid.weight_process import WeightData
from hri_prediction.motor_control.costs import CHAPTER_2

TASKS = 30


def law(person: str, own: float, seed: int = 0) -> dict[str, Any]:
    """Weights of hand jerk follow the way of the elbow, and are higher with one person than another."""
    rng = np.random.default_rng(seed)
    tasks = []
    for number in range(TASKS):
        start, end = rng.uniform(0.0, 60.0, 3), rng.uniform(0.0, 60.0, 3)
        slope = (end[1] - start[1]) / 60.0
        tasks.append(
            {
                "task": f"T{number}",
                "q_start_deg": start.tolist(),
                "q_end_deg": end.tolist(),
                "logs": [slope + own, 0.0, 0.0],
                "log_sd": [0.05] * 3,
            }
        )
    return {"person": person, "tasks": tasks}


def test_both_arms_of_a_person_are_left_out_together() -> None:
    laws = [law(who, 0.0) for who in ("ann left", "ann right", "bob right", "S1")]
    found = by_person(laws)
    assert {who: len(own) for who, own in found.items()} == {"ann": 2, "bob": 1, "S1": 1}


def test_people_alike_tell_of_each_other() -> None:
    laws = [law(f"S{number}", 0.0) for number in range(4)]
    own, mean = people_left_out(CHAPTER_2, laws)
    assert own < 0.01 < 0.02 < mean


def test_people_who_differ_are_not_told_by_others() -> None:
    laws = [law(f"S{number}", own) for number, own in enumerate((-1.5, 0.0, 1.5))]
    by_people, _ = people_left_out(CHAPTER_2, laws)
    # The others' mean is 0.75, 0 and -0.75 where -1.5, 0 and 1.5 is true.
    alphas = [
        np.exp([each, 0.0, 0.0, 0.0]) / np.exp([each, 0.0, 0.0, 0.0]).sum() for each in (-1.5, 0.75)
    ]
    rough = 2.0 / 3.0 * float(np.abs(alphas[0] - alphas[1]).mean())
    assert by_people == pytest.approx(rough, rel=0.5)


def test_a_persons_other_reaches_do_not_give_theirs_away() -> None:
    """Whole people are left out where weights are those of reaches, too, and not of laws."""
    laws = [law(f"S{number}", own, seed=number) for number, own in enumerate((-1.5, 0.0, 1.5))]
    parts = [data_of_laws(CHAPTER_2, [one]) for one in laws]
    data = WeightData(
        CHAPTER_2,
        *(
            np.concatenate([getattr(part, key) for part in parts])
            for key in ("inputs", "logs", "variance")
        ),
    )
    person = [whose(f"{one['person']} right") for one in laws for _ in range(TASKS)]
    by_reaches, plain = reaches_left_out(data, person)
    by_people, _ = people_left_out(CHAPTER_2, laws)
    assert by_reaches == pytest.approx(by_people, rel=0.2)
    assert plain > 0.05
