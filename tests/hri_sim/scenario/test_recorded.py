"""Scenarios around a recorded person: reaches at their own times of the recording, drawn to collide."""

import dataclasses

import numpy as np
import pytest

from hri_prediction.errors import PlanningError
from hri_prediction.tracks.track import ArmTrack
from hri_sim.scenario.recorded import CYCLE_S, recorded_scenario


def track(duration_s: float, middle_x: float = 0.55) -> ArmTrack:
    """An arm that comes from across the table and swings its hand over it, once in 2 s."""
    time_s = np.arange(0.0, duration_s, 0.01)
    swing = 0.25 * np.sin(np.pi * time_s)
    points = np.empty((len(time_s), 4, 3))
    points[:, 0] = (middle_x + 0.55, 0.0, 0.35)
    points[:, 3] = np.column_stack(
        [np.full_like(swing, middle_x), swing, np.full_like(swing, 0.15)]
    )
    points[:, 1] = 0.6 * points[:, 0] + 0.4 * points[:, 3]
    points[:, 2] = 0.15 * points[:, 0] + 0.85 * points[:, 3]
    return ArmTrack(time_s, points, side="right", task="swing", subject="nobody", trial=0)


def test_reaches_begin_at_their_times_of_the_recording() -> None:
    scenario = recorded_scenario(track(2.0 * CYCLE_S + 1.0), 3)
    assert [reach.start for reach in scenario.reaches] == [0.0, CYCLE_S]
    assert scenario.reaches[0].person_target == "recorded"
    assert all(reach.person_target is None for reach in scenario.reaches[1:])
    assert scenario == recorded_scenario(track(2.0 * CYCLE_S + 1.0), 3)


def test_the_persons_target_is_where_the_first_reach_ends() -> None:
    """It is what a predictor that learns the person is told of."""
    swing = track(4.0)
    rested = np.clip(swing.time_s, 0.5, 1.5)  # from one side to the other between two rests
    points = np.stack(
        [np.interp(rested, swing.time_s, column) for column in swing.keypoints.reshape(-1, 12).T]
    )
    reach = dataclasses.replace(swing, keypoints=points.T.reshape(-1, 4, 3))
    scenario = recorded_scenario(reach, 3)
    assert scenario.targets["recorded"] == pytest.approx(reach.keypoints[-1, 3], abs=0.01)
    assert scenario.persons[0].home == pytest.approx(reach.keypoints[0, 3], abs=0.01)


def test_a_short_recording_has_one_reach() -> None:
    assert len(recorded_scenario(track(1.5), 1).reaches) == 1


def test_a_person_out_of_the_way_is_no_test() -> None:
    with pytest.raises(PlanningError, match="collides with the recording"):
        recorded_scenario(track(1.5, middle_x=3.0), 1)
