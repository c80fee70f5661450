"""Predictions that come over the graph."""

from __future__ import annotations

import numpy as np
import pytest
from std_msgs.msg import Header

from hri_planner.ros.conversions import forecast_from_message
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import HumanPrediction

RADII = np.array([0.05, 0.04, 0.05])


def prediction(times: list[float]) -> HumanPrediction:
    count = len(times)
    arm = np.array([[0.9, 0.2, 0.4], [0.85, 0.2, 0.12], [0.6, 0.2, 0.1], [0.5, 0.2, 0.1]])
    return HumanPrediction(
        header=Header(frame_id=WORLD),
        body_id="ann",
        side="right",
        times=times,
        mean=np.tile(arm, (count, 1, 1)).ravel(),
        covariance=np.tile(1e-4 * np.eye(3), (4 * count, 1, 1)).ravel(),
    )


@pytest.mark.parametrize("first_s", [0.0, 1e-9])
def test_times_from_the_newest_sample_on_are_taken(first_s: float) -> None:
    times = [first_s, 0.1, 0.2, 0.30001]
    assert forecast_from_message(prediction(times), 0, RADII) is not None


@pytest.mark.parametrize(
    "times",
    [
        pytest.param([5.0, 5.1], id="later"),
        pytest.param([0.0, 0.1, 0.3], id="unequal steps"),
        pytest.param([0.0, float("nan"), 0.2], id="not a number"),
        pytest.param([float("inf"), float("inf")], id="infinite"),
        pytest.param([0.3, 0.0], id="descending"),
        pytest.param([0.0, 0.0, 0.1], id="twice the same"),
    ],
)
def test_other_times_are_refused(times: list[float]) -> None:
    with pytest.raises(DataError, match=r"'ann' is for .*expected 0 first, and equal steps"):
        forecast_from_message(prediction(times), 0, RADII)
