"""The monitor slows, stops and lets go, and whatever it does not know stops the robot."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_planner.robot import load_robot
from hri_planner.separation.config import BodyConfig, ProtectiveDistanceConfig, ReleaseConfig
from hri_planner.separation.monitor import (
    ArmPrediction,
    SeparationMonitor,
    State,
    Verdict,
)
from hri_planner.separation.pairs import robot_ends
from hri_planner.separation.parts import SeenArm
from hri_planner.separation.robot_state import MAX_APART_S, RobotState
from hri_planner.warm import warm_separation
from hri_prediction.errors import ConfigError

warm_separation()
ROBOT = load_robot()
POSTURE = np.radians([0.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0])
TOOL = ROBOT.frames(POSTURE)[3]
STILL = RobotState(POSTURE, np.zeros(7), 0.002, 1.0)
MS = 1_000_000


def arm(distance: float, speed: float = 0.0, age: float = 0.01) -> list[SeenArm]:
    """A right arm ahead of the tool, whose hand is so far from the robot's surface [m]."""
    tip = TOOL + np.array([distance + 0.05 + ROBOT.capsule_radii[2], 0.0, 0.0])
    offsets = np.array([[0.6, 0.0, 0.3], [0.35, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])
    speeds = np.tile([-speed, 0.0, 0.0], (4, 1))
    return [SeenArm("right", tip + offsets, np.full(4, age), speeds, np.zeros(4), 0.024)]


def monitor(**release: float) -> SeparationMonitor:
    return SeparationMonitor(
        ROBOT,
        ProtectiveDistanceConfig(intrusion=0.0),
        BodyConfig(trunk=False),
        ReleaseConfig(**release),
    )


def decide(made: SeparationMonitor, ms: int, arms: Sequence[SeenArm], **other: object) -> Verdict:
    return made.decide(ms * MS, STILL, {"person1": arms}, **other)  # type: ignore[arg-type]


def let_go(made: SeparationMonitor, ms: int = 0, distance: float = 2.0) -> int:
    """Let the robot go, and the time at which it is [ms]."""
    while decide(made, ms, arm(distance)).state != State.FREE:
        ms += 4
        assert ms < 2000
    return ms


@given(q=st.lists(st.floats(-1.5, 1.5), min_size=7, max_size=7), seed=st.integers(0, 1000))
def test_speeds_of_the_robot_s_joints(q: list[float], seed: int) -> None:
    """Against finite differences."""
    posture, qd = np.array(q), np.random.default_rng(seed).normal(size=7)
    ends, speeds = np.empty((4, 3)), np.empty((4, 3))
    robot_ends(posture, qd, ROBOT.lengths, ends, speeds)
    np.testing.assert_allclose(ends, ROBOT.frames(posture), atol=1e-12)
    h = 1e-6
    ahead = (ROBOT.frames(posture + h * qd) - ROBOT.frames(posture - h * qd)) / (2.0 * h)
    np.testing.assert_allclose(speeds, ahead, atol=1e-6)


def test_nobody_there_is_full_speed_after_a_moment() -> None:
    made = monitor()
    assert made.decide(0, STILL, {}).state == State.STOPPED
    verdict = made.decide(200 * MS, STILL, {})
    assert (verdict.state, verdict.scale, verdict.reason) == (State.FREE, 1.0, "")


def test_the_nearer_the_slower_until_it_stops() -> None:
    made = monitor()
    ms = let_go(made)
    scales = []
    for distance in np.linspace(0.6, 0.05, 56):
        ms += 4
        verdict = decide(made, ms, arm(distance))
        scales.append(verdict.scale)
        # At the speed that is commanded, the protective distance is kept.
        if verdict.scale > 0.1:  # slower, the speed at which it set out would count
            slower = replace(STILL, rate=verdict.scale)
            at_it = made.decide(ms * MS, slower, {"person1": arm(distance)})
            assert at_it.protective <= at_it.distance + 1e-9
    assert scales[0] == 1.0
    assert scales[-1] == 0.0
    assert all(later <= earlier for earlier, later in itertools.pairwise(scales))
    assert sum(0.0 < scale < 1.0 for scale in scales) >= 8
    assert verdict.state == State.STOPPED
    assert "right hand of person1" in verdict.reason
    assert verdict.robot_part == "hand"


def test_terms_add_up() -> None:
    made = monitor()
    ms = let_go(made)
    verdict = decide(made, ms + 4, arm(0.4))
    config = ProtectiveDistanceConfig()
    total = verdict.human + verdict.reaction + verdict.stopping
    assert verdict.protective == pytest.approx(total + config.sensor_error + config.robot_error)
    assert verdict.margin == pytest.approx(verdict.distance - verdict.protective)
    assert verdict.distance == pytest.approx(0.4)
    assert verdict.human_speed == pytest.approx(2.0)


def test_a_robot_that_comes_nearer_needs_more_room() -> None:
    made = monitor()
    ms = let_go(made)
    still = decide(made, ms, arm(0.5)).protective
    # Joint 4 stretches the arm forwards.
    coming = replace(STILL, qd=np.array([0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0]))
    verdict = made.decide(ms * MS, coming, {"person1": arm(0.5)})
    assert verdict.robot_speed > 0.1
    assert verdict.protective > still + 0.01
    leaving = made.decide(ms * MS, replace(coming, qd=-coming.qd), {"person1": arm(0.5)})
    assert leaving.robot_speed < -0.1
    assert leaving.protective <= still


def test_a_reference_of_another_time_tells_neither_rate_nor_path() -> None:
    """Said to be at full rate, and slowed since: what is measured is not a tenth of the truth then."""
    qd = np.array([0.0, 0.0, 0.0, -0.1, 0.0, 0.0, 0.0])
    fresh = RobotState.following(POSTURE, qd, 0.002, 1.0, 10.0 * qd, MAX_APART_S)
    assert (fresh.rate, fresh.path_qd is None) == (1.0, False)
    stale = RobotState.following(POSTURE, qd, 0.002, 1.0, 10.0 * qd, 1.01 * MAX_APART_S)
    assert (stale.rate, stale.path_qd) == (0.0, None)

    def allowed(state: RobotState) -> float:
        made = monitor()
        for ms in range(0, 1000, 8):
            verdict = made.decide(ms * MS, state, {"person1": arm(0.36)})
        return verdict.scale

    assert allowed(stale) < allowed(fresh)


def test_the_path_is_known_as_long_as_the_robot_moves_along_it() -> None:
    qd_ref = np.full(7, 0.02)
    slow = RobotState.following(POSTURE, qd_ref, 0.002, 0.1, qd_ref)
    assert slow.path_qd is not None
    np.testing.assert_allclose(slow.path_qd, 0.2)
    assert RobotState.following(POSTURE, qd_ref, 0.002, 0.0, 0.0 * qd_ref).path_qd is None


def test_a_stopped_robot_is_let_go_after_a_while_with_room() -> None:
    made = monitor(release_time=0.1)
    ms = let_go(made)
    assert decide(made, ms, arm(0.1)).state == State.STOPPED
    # Room, then none for a moment: the while begins anew.
    assert decide(made, ms + 40, arm(1.0)).reason.startswith("room again")
    assert decide(made, ms + 120, arm(0.1)).state == State.STOPPED
    assert decide(made, ms + 124, arm(1.0)).state == State.STOPPED
    assert decide(made, ms + 220, arm(1.0)).state == State.STOPPED
    assert decide(made, ms + 224, arm(1.0)).state == State.FREE


def test_at_the_edge_it_does_not_chatter() -> None:
    made = monitor()
    ms = let_go(made)
    rng = np.random.default_rng(0)
    rate, scales = 1.0, []
    for tick in range(200):
        robot = replace(STILL, rate=rate)
        seen = {"person1": arm(0.38 + rng.uniform(-0.008, 0.008))}
        rate = made.decide((ms + 4 * tick) * MS, robot, seen).scale
        scales.append(rate)
    assert 0.1 < min(scales) < max(scales) < 1.0
    # Noise within the release margin never makes it faster.
    assert not (np.diff(scales) > 1e-9).any()


def test_what_is_not_known_stops_the_robot() -> None:
    made = monitor()
    ms = let_go(made)
    verdict = made.decide((ms + 4) * MS, None, {})
    assert (verdict.state, verdict.reason) == (State.STOPPED, "nobody knows where the robot is")
    let_go(made, ms + 8)
    verdict = decide(made, ms + 500, arm(1.0), trouble="no arm of person2 yet")
    assert (verdict.scale, verdict.reason) == (0.0, "no arm of person2 yet")
    assert verdict.distance == pytest.approx(1.0)  # of those who are seen, it still speaks


def test_numbers_that_are_none_stop_the_robot() -> None:
    made = monitor()
    ms = let_go(made)
    wrong = arm(1.0)
    wrong[0].keypoints[3, 0] = np.nan
    assert decide(made, ms + 4, wrong).scale == 0.0
    let_go(made, ms + 8)
    lost = replace(STILL, qd=np.full(7, np.nan))
    assert made.decide((ms + 900) * MS, lost, {"person1": arm(0.5)}).scale == 0.0


def test_what_is_not_known_is_not_harmless() -> None:
    distance = ProtectiveDistanceConfig(intrusion=0.0, contact_speed=0.15)
    made = SeparationMonitor(ROBOT, distance, BodyConfig(trunk=False), ReleaseConfig())
    ms = let_go(made)
    beside = decide(made, ms + 4, arm(0.05)).scale
    assert 0.1 < beside < 1.0
    wrong = arm(0.05)
    wrong[0].keypoints[3, 0] = np.nan
    assert decide(made, ms + 8, wrong).scale == 0.0
    lost = replace(STILL, qd=np.full(7, np.nan))
    assert made.decide((ms + 12) * MS, lost, {"person1": arm(0.5)}).scale == 0.0


def test_a_person_without_an_arm_stops_the_robot() -> None:
    made = monitor()
    ms = let_go(made)
    verdict = made.decide((ms + 4) * MS, STILL, {"person1": []})
    assert (verdict.state, verdict.reason) == (State.STOPPED, "no arm of person1 yet")


def test_a_part_that_moves_away_is_let_go_on_where_that_is_asked_for() -> None:
    leaving = replace(STILL, qd=np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]))
    scales = []
    for evasion in (False, True):
        distance = ProtectiveDistanceConfig(intrusion=0.0, human="measured", evasion=evasion)
        made = SeparationMonitor(ROBOT, distance, BodyConfig(trunk=False), ReleaseConfig())
        ms = let_go(made)
        scales.append(made.decide((ms + 4) * MS, leaving, {"person1": arm(0.10)}).scale)
    # The lower arm, whose elbow stays where it is, still counts.
    assert scales[0] == 0.0
    assert scales[1] > 0.3


def test_old_samples_need_more_room() -> None:
    made = monitor()
    ms = let_go(made)
    fresh, old = decide(made, ms, arm(1.0)), decide(made, ms, arm(1.0, age=0.08))
    assert old.protective == pytest.approx(fresh.protective + 2.0 * 0.07)


def prediction(speed: float, arms: Sequence[SeenArm]) -> ArmPrediction:
    times = np.linspace(0.0, 0.5, 26)
    mean = arms[0].keypoints + times[:, None, None] * np.array([-speed, 0.0, 0.0])
    return ArmPrediction(0.01, times, mean, np.tile(1e-6 * np.eye(3), (26, 4, 1, 1)))


def test_predictions_let_the_robot_come_nearer_to_a_hand_that_rests() -> None:
    distance = ProtectiveDistanceConfig(intrusion=0.0, human="predicted")
    made = SeparationMonitor(ROBOT, distance, BodyConfig(trunk=False), ReleaseConfig())
    arms = arm(0.32)
    resting = {("person1", "right"): prediction(0.0, arms)}
    for ms in range(0, 400, 4):
        verdict = decide(made, ms, arms, predictions=resting)
    assert (verdict.state, verdict.mode) == (State.FREE, "predicted")
    coming = {("person1", "right"): prediction(1.5, arms)}
    assert decide(made, 404, arms, predictions=coming).scale < 0.5
    # Whom nothing is predicted of, also the other arm, counts as assumed.
    left = [replace(arms[0], side="left")]
    verdict = decide(made, 408, left, predictions=resting)
    assert verdict.mode == "assumed"
    assert verdict.scale < 0.3


def test_measured_speeds_let_the_robot_come_nearer_too() -> None:
    distance = ProtectiveDistanceConfig(intrusion=0.0, human="measured")
    made = SeparationMonitor(ROBOT, distance, BodyConfig(trunk=False), ReleaseConfig())
    for ms in range(0, 400, 4):
        verdict = decide(made, ms, arm(0.32))
    assert (verdict.state, verdict.mode) == (State.FREE, "measured")
    assert decide(made, 404, arm(0.32, speed=1.5)).scale < 0.3


def test_trunk_and_head_are_slower_than_arms() -> None:
    made = SeparationMonitor(ROBOT, ProtectiveDistanceConfig(), BodyConfig(), ReleaseConfig())
    seen = arm(1.0)
    # Folded back, so that the trunk is nearest.
    seen[0].keypoints[1:] = seen[0].keypoints[0] + [
        [0.1, 0, -0.25],
        [0.2, 0, -0.4],
        [0.25, 0, -0.5],
    ]
    verdict = decide(made, 0, seen)
    assert verdict.human_part in ("trunk", "head")
    assert verdict.human_speed == pytest.approx(1.6)


def test_samples_may_be_older_than_their_stamps_say() -> None:
    config = ProtectiveDistanceConfig(stamp_error=0.0)
    release = ReleaseConfig(max_future=0.0)
    exact = SeparationMonitor(ROBOT, config, BodyConfig(), release)
    with_error = SeparationMonitor(ROBOT, replace(config, stamp_error=0.02), BodyConfig(), release)
    ways = [one.decide(MS, STILL, {"ann": arm(0.5)}).human for one in (exact, with_error)]
    assert ways[1] - ways[0] == pytest.approx(0.02 * config.arm_speed)


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_so_may_joint_states(speed: float) -> None:
    """A clock that is ahead makes them look newer: the robot has gone on for longer."""
    config = ProtectiveDistanceConfig(stamp_error=0.0, robot_acceleration=0.0)
    release = ReleaseConfig(max_future=0.0)
    moving = replace(STILL, qd=np.array([0.0, speed, 0.0, 0.0, 0.0, 0.0, 0.0]))
    exact, with_error = (
        SeparationMonitor(ROBOT, replace(config, stamp_error=error), BodyConfig(), release)
        for error in (0.0, 0.02)
    )
    older = replace(moving, age_s=moving.age_s + 0.02)
    seen, aged = (arm(0.5, age=age) for age in (0.01, 0.03))
    robot, truth = (
        one.decide(MS, state, {"ann": who})
        for one, state, who in ((with_error, moving, seen), (exact, older, aged))
    )
    assert robot.reaction == pytest.approx(truth.reaction)
    assert robot.stopping == pytest.approx(truth.stopping)
    # What may be old are the samples, not the time: S_h has that once, as with samples that are older.
    assert robot.human == pytest.approx(exact.decide(MS, moving, {"ann": aged}).human)


def test_stamps_that_are_farther_ahead_than_clocks_differ_are_not_taken() -> None:
    with pytest.raises(ConfigError, match=r"max_future = 0\.01 s, stamp_error = 0\.005 s"):
        SeparationMonitor(
            ROBOT, ProtectiveDistanceConfig(), BodyConfig(), ReleaseConfig(max_future=0.01)
        )


def test_what_paths_ask_of_the_robot_is_noted_with_nobody_there() -> None:
    made = monitor()
    still = made.path
    for ms in range(0, 400, 8):
        path_qd = np.array([0.0, 0.0, 0.0, 0.01 * ms, 0.0, 0.0, 0.0])
        made.decide(ms * MS, replace(STILL, path_qd=path_qd), {})
    assert still is made.path
    # The elbow bends at up to 3.92 rad/s, which grows by 10 rad/s a second; from there to the tool.
    reach = float(np.linalg.norm(TOOL - ROBOT.frames(POSTURE)[1]))
    assert made.path.fastest == pytest.approx(3.92 * reach, rel=1e-6)
    assert made.path.gained == pytest.approx(10.0 * reach, rel=1e-6)
