"""What is expected of anybody, by the laws of some people: means of tasks, and how sure they are."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.hybrid.fit_command import read_results
from hri_prediction.hybrid.of_laws import data_of_laws
from hri_prediction.hybrid.weight_process import LEAST_WEIGHT, PERSON_SD
from hri_prediction.motor_control.costs import CHAPTER_2


def law(
    logs: list[list[float]], sd: float = 0.1, tasks: tuple[str | None, ...] = ("A", "B")
) -> dict[str, Any]:
    """As `fit_ioc.py` writes it, of some tasks."""
    return {
        "person": "somebody",
        "tasks": [
            {
                "task": task,
                "q_start_deg": [10.0 * number, 0.0, 20.0],
                "q_end_deg": [0.0, 60.0, 20.0],
                "logs": row,
                "log_sd": [sd] * 3,
            }
            for number, (task, row) in enumerate(zip(tasks, logs, strict=True))
        ],
    }  # fmt: skip


def test_a_task_of_many_is_known_by_their_mean() -> None:
    laws = [law([[0.1 * n, -0.1 * n, 0.0], [0.0, 0.0, -0.5]]) for n in range(5)]
    data = data_of_laws(CHAPTER_2, laws)
    assert len(data) == 2
    np.testing.assert_allclose(data.logs, [[0.2, -0.2, 0.0], [0.0, 0.0, -0.5]], atol=1e-12)
    np.testing.assert_allclose(np.degrees(data.inputs[1]), [10.0, 0.0, 20.0, 0.0, 60.0, 20.0])
    scatter = np.square(0.1 * (np.arange(5) - 2)).sum()
    expected = ((PERSON_SD**2 + scatter) / 5 + 0.1**2) / 5
    assert data.variance[0, 0] == pytest.approx(expected)
    assert data.variance[0, 2] == pytest.approx((PERSON_SD**2 / 5 + 0.1**2) / 5)


def test_of_one_person_nobody_knows_how_others_differ() -> None:
    data = data_of_laws(CHAPTER_2, [law([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])])
    np.testing.assert_allclose(data.variance, PERSON_SD**2 + 0.1**2)


def test_tasks_without_a_name_are_nobody_elses() -> None:
    laws = [law([[0.0] * 3, [1.0] * 3], tasks=(None, None)) for _ in range(2)]
    assert len(data_of_laws(CHAPTER_2, laws)) == 4


def test_weights_that_are_next_to_nothing_are_not_told_apart() -> None:
    """A law may say e^-12 of what no path shows; and may know nothing of it."""
    both = [law([[0.0, -12.0, 0.0], [0.0] * 3], sd=1e3), law([[0.0, -6.0, 0.0], [0.0] * 3], sd=1e3)]
    data = data_of_laws(CHAPTER_2, both)
    assert data.logs[0, 1] == pytest.approx(np.log(LEAST_WEIGHT * 3.0), abs=0.02)
    assert (data.variance <= 9.0).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"logs": [0.0, 0.0]}, "three|3 finite"),
        ({"logs": [0.0, 0.0, float("nan")]}, "3 finite"),
        ({"q_end_deg": [0.0]}, "six angles"),
        ({"log_sd": "none"}, "lacks or garbles"),
    ],
)
def test_laws_that_are_none_are_refused(change: dict[str, Any], says: str) -> None:
    one = law([[0.0] * 3, [0.0] * 3])
    one["tasks"][1] |= change
    with pytest.raises(DataError, match=says):
        data_of_laws(CHAPTER_2, [one])
    with pytest.raises(DataError, match="without a task"):
        data_of_laws(CHAPTER_2, [{"tasks": []}])
    with pytest.raises(DataError, match="joint_jerk"):
        data_of_laws(("hand_jerk", "energy"), [one])


def test_laws_of_cut_reaches_say_nothing_and_are_not_taken(tmp_path: Any) -> None:
    row = {
        "name": "a",
        "error": "",
        "q_start_deg": [10.0] * 3,
        "q_end_deg": [30.0] * 3,
        "alpha": [0.25] * 4,
        "covariance": np.diag([0.01] * 4).ravel().tolist(),
        "factors": [1.0] * 4,
        "rest_factors": [1.0] * 4,
    }
    content = {"costs": list(CHAPTER_2), "reaches": [row] * 3, "laws": [law([[0.0] * 3] * 2)]}
    path = tmp_path / "results.json"
    for whole, what in ((True, "2 reaches by the laws of 1 arms"), (False, "3 single reaches")):
        path.write_text(json.dumps({**content, "whole": whole}))
        assert read_results(path).what == what
