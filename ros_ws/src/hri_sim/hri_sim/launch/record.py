"""From the bags of a run to arrays and figures. They are the only witnesses."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.ros.messages import HumanPrediction, PolicyStatus
from hri_prediction.ros.time import NANO, to_ns
from hri_sim.launch.reports import ReachReport
from hri_sim.launch.run_bags import RunBags
from hri_sim.media.frames import (
    HOLE_S,
    BaselineTrack,
    PredictionMark,
    ReachMark,
    RunRecord,
    holes,
)
from hri_sim.scenario.schema import PersonSpec, Scenario
from hri_sim.simulator.baseline import run_baseline

FloatArray = NDArray[np.float64]
GOALS_APART_M = 0.01
"""Places of a goal that moves are shown this far apart [m]."""
_FAR = 1e8  # clearances beyond this mean that nobody was there


@dataclass(frozen=True)
class Series:
    """Figures of a run over time; times on the run's clock [s]: zero at the first state of the simulator.

    Attributes:
        origin_ns: ROS time of the run's zero [ns].
        record: Robot, people, clearance; what pictures are made from.
        reference_s: Times of the controller's references.
        handover_jump_rad: Step of the last hand-over before these times.
        speed_scale: Controller's speed scale at these times.
        status_s: Times of the status of the node that moves the robot.
        misses: Deadline misses of the motion so far, at these times.
        mocap_to_prediction_ms: Newest sample used → prediction sent.
        mocap_to_trajectory_ms: Newest sample used → trajectory sent.
        rates_hz: Mean rate of each topic between its first and its last message in each bag.
        lost_messages: Messages that were sent but are not in the bags, by sequence numbers.
        gaps_s: From when to when nothing was recorded: between two bags, or while the recorder was stopped
            or lost what was sent.
    """

    origin_ns: int
    record: RunRecord
    reference_s: FloatArray
    handover_jump_rad: FloatArray
    speed_scale: FloatArray
    status_s: FloatArray
    misses: NDArray[np.int64]
    mocap_to_prediction_ms: FloatArray
    mocap_to_trajectory_ms: FloatArray
    rates_hz: dict[str, float]
    lost_messages: int
    gaps_s: tuple[tuple[float, float], ...] = ()


def status_topic(topics: Iterable[str]) -> str:
    """Where the node that moved the robot in a bag with these topics said what it does."""
    return "/policy/status" if "/policy/status" in topics else "/ptomp/status"


def read_run(
    bags: RunBags,
    scenario: Scenario,
    reports: list[ReachReport],
    *,
    sensor_delay_s: float,
    title: str,
) -> Series:
    """Read a run.

    Args:
        bags: What was recorded of it.
        scenario: What was done.
        reports: How the reaches went; their times are put onto the run's clock.
        sensor_delay_s: Simulated delay of the sensor, which is not counted as latency [s].
        title: Heading of pictures.

    Raises:
        DataError: when the bag cannot be read, or lacks the state of simulator and joints.
    """
    truth = {person.id: f"/sim/bodies/{person.id}/arm" for person in scenario.persons}
    predictions = [f"/humans/bodies/{person.id}/prediction" for person in scenario.persons]
    said = status_topic(bags.topics)
    fixed = ["/sim/state", "/joint_states", said, "/joint_trajectory_controller/reference"]
    trajectories = "/joint_trajectory_controller/joint_trajectory"
    topics = {*fixed, *truth.values(), *predictions, trajectories}
    data = bags.decoded(topics & bags.topics | set(fixed))
    elsewhere = {said, trajectories, *truth.values(), *predictions}  # not from the simulator
    states = {to_ns(m.header.stamp): m for _, m in data["/sim/state"]}
    joints = {to_ns(m.header.stamp): m for _, m in data["/joint_states"]}
    stamps = np.array(sorted(states.keys() & joints.keys()))
    if len(stamps) < 2:
        raise DataError(
            f"{bags.readers[0].path} holds no /sim/state with /joint_states",
            expected="a bag of a simulated run",
        )
    origin = int(stamps[0])

    def seconds(values: list[int]) -> FloatArray:
        return (np.array(values, dtype=np.int64) - origin) / NANO

    clearance = np.array([states[int(s)].clearance for s in stamps])
    record = RunRecord(
        scenario=scenario,
        time_s=(stamps - origin) / NANO,
        q=np.array([joints[int(s)].position for s in stamps]),
        arms=_arms(
            [
                messages
                for person in scenario.persons
                for messages in _arms_of(person, data.get(truth[person.id], []))
            ],
            stamps,
        ),
        clearance_m=np.where(clearance < _FAR, clearance, np.inf),
        reaches=tuple(
            ReachMark(
                (r.cue_ns - origin) / NANO,
                (r.end_ns - origin) / NANO,
                f"reach {r.index + 1}" + ("" if r.outcome == "reached" else f": {r.outcome}"),
            )
            for r in reports
        ),
        predictions=_predictions(
            {
                # Pictures show where the hand will be that reaches.
                person.id: [
                    item for item in data.get(topic, []) if person.reaches_with(item[1].side)
                ]
                for person, topic in zip(scenario.persons, predictions, strict=True)
            },
            origin,
        ),
        title=title,
        goals=_goals([message for _, message in data[said]]),
    )
    references = [message for _, message in data["/joint_trajectory_controller/reference"]]
    status = [message for _, message in data[said]]
    delay_ns = sensor_delay_s * NANO
    to_prediction = [
        (sent - to_ns(m.header.stamp) - delay_ns) / 1e6
        for topic in predictions
        for sent, m in data.get(topic, [])
        if m.state != HumanPrediction.INVALID
    ]
    sent_at = {to_ns(m.header.stamp): sent for sent, m in data.get(trajectories, [])}
    to_trajectory = [
        (sent_at[to_ns(m.handover)] - to_ns(m.newest_sample) - delay_ns) / 1e6
        for m in status
        if to_ns(m.handover) in sent_at and to_ns(m.newest_sample)
    ]
    return Series(
        origin_ns=origin,
        record=record,
        reference_s=seconds([to_ns(m.header.stamp) for m in references]),
        handover_jump_rad=np.array([m.handover_jump for m in references]),
        speed_scale=np.array([m.speed_scale for m in references]),
        status_s=seconds([to_ns(m.header.stamp) for m in status]),
        misses=np.array([m.deadline_misses for m in status], dtype=np.int64),
        mocap_to_prediction_ms=np.array(to_prediction),
        mocap_to_trajectory_ms=np.array(to_trajectory),
        rates_hz=bags.rates_hz,
        lost_messages=bags.lost_messages,
        gaps_s=gaps_of(
            record.time_s,
            seconds([edge for gap in bags.gaps_ns for edge in gap]),
            seconds(sorted(sent for topic in elsewhere for sent, _ in data.get(topic, ()))),
        ),
    )


def gaps_of(
    states_s: FloatArray, between_bags_s: FloatArray, others_s: FloatArray
) -> tuple[tuple[float, float], ...]:
    """From when to when nothing was recorded [s], in order; what lies within another is left out.

    Args:
        states_s: Times of the states of the simulator that were recorded, ascending [s].
        between_bags_s: Begin and end of each gap between two bags, one after the other [s].
        others_s: When other nodes said what was recorded, ascending [s]: who was stopped or started again
            then was the simulator, not the recorder.
    """
    found = [
        (float(begin), float(end))
        for begin, end in ((states_s[i], states_s[i + 1]) for i in holes(states_s))
        if np.diff(np.searchsorted(others_s, (begin + 0.5 * HOLE_S, end - 0.5 * HOLE_S)))[0] == 0
    ]
    found += [(float(a), float(b)) for a, b in between_bags_s.reshape(-1, 2)]
    return tuple(
        gap
        for gap in sorted(set(found))
        if not any(a <= gap[0] and gap[1] <= b and (a, b) != gap for a, b in found)
    )


def _goals(status: list[Any]) -> FloatArray | None:
    """Where a policy was sent (M, 3) [m], each place once; none when nothing says so."""
    found: list[FloatArray] = []
    for message in status:
        if isinstance(message, PolicyStatus) and message.stage == PolicyStatus.MOVING:
            place = np.array(message.goal)
            if not found or np.linalg.norm(place - found[-1]) > GOALS_APART_M:
                found.append(place)
    return np.array(found) if found else None


def _arms_of(person: PersonSpec, messages: list[tuple[int, Any]]) -> list[list[tuple[int, Any]]]:
    """Of each arm of a person what was said of it; of a person of one arm, of whichever came first."""
    sides = [arm.side for arm in person.arms.values()]
    if not person.both_arms and messages:
        sides = [messages[0][1].side]
    return [[item for item in messages if item[1].side == side] for side in sides]


def _arms(messages: list[list[tuple[int, Any]]], stamps: NDArray[np.int64]) -> FloatArray:
    """True arms (N, A, 4, 3) [m] at the stamps, by interpolation; NaN before the first one."""
    arms = np.full((len(stamps), len(messages), 4, 3), np.nan)
    for row, items in enumerate(messages):
        if len(items) < 2:
            continue
        times = np.array([to_ns(m.header.stamp) for _, m in items])
        order = np.unique(times, return_index=True)[1]
        flat = np.array([m.keypoints for _, m in items])[order]
        grid = (times[order] - stamps[0]) / NANO
        wanted = (stamps - stamps[0]) / NANO
        columns = [np.interp(wanted, grid, flat[:, k], left=np.nan) for k in range(12)]
        arms[:, row] = np.stack(columns, axis=1).reshape(-1, 4, 3)
    return arms


def _predictions(data: dict[str, list[tuple[int, Any]]], origin: int) -> tuple[PredictionMark, ...]:
    marks = []
    for body_id, messages in data.items():
        for _, message in messages:
            if message.state == HumanPrediction.INVALID:
                continue
            count = len(message.times)
            covariance = np.array(message.covariance).reshape(count, 4, 3, 3)
            marks.append(
                PredictionMark(
                    time_s=(to_ns(message.header.stamp) - origin) / NANO,
                    mean=np.array(message.mean).reshape(count, 4, 3),
                    sigma=np.sqrt(np.linalg.eigvalsh(covariance)[..., -1].clip(min=0.0)),
                    body_id=body_id,
                )
            )
    return tuple(sorted(marks, key=lambda mark: mark.time_s))


def with_baseline(record: RunRecord) -> RunRecord:
    """The record with the same scene and people, and nominal motions without replanning.

    The people are the recorded truth, the simulator the same, contacts are off. Reaches whose end was
    not recorded are left out; without any other there is no baseline.
    """
    scenario = record.scenario
    starts = [mark.start_s for mark in record.reaches if mark.end_s <= record.time_s[-1]]
    if not scenario.persons or not starts:
        return record
    truth: dict[str, Any] = {}
    for index, name in enumerate(scenario.arms):
        arm = record.arms[:, index].reshape(-1, 12)
        seen = np.isfinite(arm).all(axis=1)
        if not seen.any():
            continue
        truth[name] = _interpolator(record.time_s[seen], arm[seen])
    last = scenario.reaches[len(starts) - 1]
    hold = max(float(record.time_s[-1]) - starts[-1] - last.duration, 0.6)
    result = run_baseline(scenario, truth, starts, hold_s=hold)
    return replace(
        record,
        baseline=BaselineTrack(time_s=result.time_s, q=result.q, clearance_m=result.clearance_m),
    )


def _interpolator(time_s: FloatArray, values: FloatArray) -> Any:
    def at(now: float) -> FloatArray:
        return np.array([np.interp(now, time_s, column) for column in values.T]).reshape(4, 3)

    return at
