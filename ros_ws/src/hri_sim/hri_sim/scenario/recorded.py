"""A scenario around a recorded person: robot reaches that nominally collide with the recording.

As in :mod:`~hri_sim.scenario.conditions`, only nominal motions decide, never a planner's outcome.
The recording starts with the first reach and plays to its end, whatever the robot does. Each reach begins
at its own time of the recording, so that those drawn to collide would collide live; they are as many as the
person's movements allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_planner.robot import load_robot
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.tracks.segmentation import find_reaches
from hri_prediction.tracks.track import ArmTrack
from hri_sim.scenario.conditions import ROBOT_ABS_Y, ROBOT_DURATION_S, ROBOT_X, ROBOT_Z
from hri_sim.scenario.examination import RobotPart, clearance_series, robot_part
from hri_sim.scenario.schema import PersonSpec, Posture, ReachSpec, Scenario, TableSpec, Vector3

CYCLE_S = 4.0
"""Time from the start of one reach to the start of the next, long enough for slow reaches [s]."""
START_CLEARANCE_M = 0.10
HOLD_CLEARANCE_M = 0.03
_ELBOW_UP = np.array([0.0, -0.4, 0.0, 1.5, 0.0, -0.8, 0.0])
_SCENES = 400
_FAIR_SEARCH = 25
_GOALS = 60


@dataclass(frozen=True)
class _Draw:
    """The robot's part of a scene: joint angles at the start, goals, the person's delay [s]."""

    q_start: Posture = (0.0,) * 7
    goals: tuple[Vector3, ...] = ()
    delay: float = 0.0
    collisions: int = 0


def recorded_person(track: ArmTrack, body_id: str = "person1") -> PersonSpec:
    """Person whose shoulder and lengths are those of a recording, in world coordinates.

    Raises:
        DataError: when shoulder, elbow, wrist or hand tip are never seen.
    """
    seen = track.keypoints[np.isfinite(track.keypoints).all(axis=(1, 2))]
    if not len(seen):
        raise DataError("the recording never shows the whole arm", expected="all four keypoints")
    lengths = np.median(np.linalg.norm(np.diff(seen, axis=1), axis=2), axis=0)
    shoulder = np.median(seen[:, 0], axis=0)
    # The shoulder moves in real recordings: as long an arm as the furthest place asks for.
    furthest = float(np.linalg.norm(seen[:, 3] - shoulder, axis=1).max())
    hand = max(float(lengths[2]), furthest / 0.98 - float(lengths[0] + lengths[1]))
    return PersonSpec(
        id=body_id,
        side="left" if track.side == "left" else "right",
        shoulder=_vector(shoulder),
        upper_arm=float(lengths[0]),
        forearm=float(lengths[1]),
        hand=hand,
        home=_vector(seen[0, 3]),
        noise_sd=0.0,
        latency=0.0,
        dropout_rate=0.0,
        marker_dropout_rate=0.0,
    )


def _reached(track: ArmTrack) -> Vector3:
    """Where the tip of the hand is at the end of the first reach; without one, where it is seen last."""
    seen = np.flatnonzero(np.isfinite(track.keypoints[:, 3]).all(axis=1))
    reaches = find_reaches(track.time_s, track.keypoints[:, 2])
    row = seen[-1]
    if reaches:
        row = seen[np.abs(track.time_s[seen] - reaches[0].end_s).argmin()]
    return _vector(track.keypoints[row, 3])


def recorded_scenario(track: ArmTrack, seed: int, reaches: int | None = None) -> Scenario:
    """Draw the robot's part of a scene in which a recording is replayed.

    Args:
        track: The recording, placed in the world.
        seed: Seed of the draw.
        reaches: Robot reaches; none: as many as fit into the recording, one every :data:`CYCLE_S` (at
            least one).

    Raises:
        PlanningError: when nothing drawn makes a fair test; e.g. the person sits out of the way.
        DataError: when the recording does not show the arm.
    """
    count = reaches or max(1, int(track.duration / CYCLE_S))
    person = recorded_person(track)
    rng = np.random.default_rng((seed, count))
    filled, best = track.filled(10.0), _Draw()
    for number in range(_SCENES):
        found = _draw(filled, count, rng)
        best = max(best, found, key=lambda drawn: drawn.collisions)
        # The person may be out of reach at one of the times: then as many collide as a fair search finds.
        if best.collisions == count or (best.collisions and number >= _FAIR_SEARCH):
            break
    else:
        raise PlanningError(
            "no robot reach was found that collides with the recording, starts 10 cm and ends 3 cm "
            "clear of it",
            hint="place the person differently (--place X,Y,Z,YAW), or give a --scenario",
        )
    targets = {f"robot_{i + 1}": goal for i, goal in enumerate(best.goals)}
    targets["recorded"] = _reached(track)
    specs = [
        ReachSpec(
            robot_target=f"robot_{i + 1}",
            person_target="recorded" if i == 0 else None,
            person_delay=best.delay if i == 0 else 0.0,
            person_duration=track.duration / 1.4,
            duration=ROBOT_DURATION_S,
            start=i * CYCLE_S,
        )
        for i in range(count)
    ]
    return Scenario(
        name=f"recorded_{track.subject}_{track.task}_{track.trial}",
        seed=seed,
        robot_start=best.q_start,
        table=TableSpec(),
        targets=targets,
        persons=(person,),
        reaches=tuple(specs),
    )


def _draw(track: ArmTrack, count: int, rng: np.random.Generator) -> _Draw:
    """One scene; without goals when it cannot be.

    A reach collides if any of the goals tried does so; else it is the first that is clear.
    """
    robot, table = load_robot(), TableSpec()
    left = bool(rng.integers(2))
    delay = round(float(rng.uniform(0.0, 0.6)), 3)
    start = _robot_point(rng, left)
    posture = _ELBOW_UP.copy()
    posture[0] = np.arctan2(start[1], start[0])
    try:
        q_start = np.round(robot_part(robot, posture, start, 1.0, table).goal, 4)
    except PlanningError:
        return _Draw()
    q, goals, collisions = q_start, [], 0
    for index in range(count):
        left = not left
        chosen: tuple[Vector3, FloatArray] | None = None
        for _ in range(_GOALS):
            goal = _robot_point(rng, left)
            try:
                part = robot_part(robot, q, goal, ROBOT_DURATION_S, table)
            except PlanningError:
                continue
            if part.speed_share > 0.9 or part.table_clearance <= 0.0:
                continue
            clear, hits = _examine(track, part, index * CYCLE_S - delay)
            if clear and (hits or chosen is None):
                chosen = goal, part.goal
            if clear and hits:
                collisions += 1
                break
        if chosen is None:
            return _Draw()
        goals.append(chosen[0])
        q = chosen[1]
    return _Draw(_posture(q_start), tuple(goals), delay, collisions)


def _examine(track: ArmTrack, part: RobotPart, begin_s: float) -> tuple[bool, bool]:
    """Whether a nominal motion starts and ends clear of the recording, and whether it collides.

    Args:
        track: The recording, in the world, without gaps.
        part: Nominal motion of the robot.
        begin_s: Time of the recording at which it begins [s].
    """
    robot = load_robot()
    times = np.clip(track.time_s[0] + begin_s + part.time, track.time_s[0], track.time_s[-1])
    flat = track.keypoints.reshape(len(track), 12)
    arm = np.stack([np.interp(times, track.time_s, flat[:, k]) for k in range(12)], axis=1)
    series = clearance_series(
        part.q,
        robot.lengths,
        robot.capsule_radii,
        np.ascontiguousarray(arm.reshape(-1, 4, 3)),
        ArmRadii().array,
    )
    collides = bool(series[: part.arrived + 1].min() < 0.0)
    clear = series[0] >= START_CLEARANCE_M and series[part.arrived :].min() >= HOLD_CLEARANCE_M
    return bool(clear), collides


def _robot_point(rng: np.random.Generator, left: bool) -> Vector3:
    x, y, z = (round(float(rng.uniform(*box)), 3) for box in (ROBOT_X, ROBOT_ABS_Y, ROBOT_Z))
    return x, y if left else -y, z


def _posture(q: FloatArray) -> Posture:
    a, b, c, d, e, f, g = (float(angle) for angle in q)
    return a, b, c, d, e, f, g


def _vector(point: FloatArray) -> Vector3:
    x, y, z = (round(float(value), 4) for value in point)
    return x, y, z
