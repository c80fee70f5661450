"""Where plans begin, and which are not sent because the robot will be elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.planner import PlannerSnapshot
from hri_planner.ros.handover import OFF_PATH_RAD, Handover
from hri_planner.ros.inputs import Inputs
from hri_planner.ros.tracker import MAX_LATENESS_NS
from hri_prediction.ros.messages import ControllerState
from hri_prediction.ros.time import to_time

MS = 1_000_000
T0 = 10_000 * MS
SPEED = np.linspace(0.1, 0.7, 7)
START = np.linspace(-0.6, 0.6, 7)


def path(start_s: float, turn: float = 0.0) -> JointPlan:
    """Steady motion along one line through plan time 0; from ``start_s`` on it may turn off [rad/s]."""
    time_s = start_s + 0.1 * np.arange(20)
    speed = SPEED + turn
    q = START + SPEED * start_s + speed * (time_s - start_s)[:, None]
    return JointPlan(time_s, q, np.tile(speed, (20, 1)), np.zeros((20, 7)))


class Planner:
    """Notes what it is told; its plan is whatever a test gives it."""

    def __init__(self) -> None:
        self.plan: JointPlan | None = path(0.0)
        self.told: list[str] = []

    def snapshot(self) -> PlannerSnapshot:
        return PlannerSnapshot(
            self.plan, "reaching", np.zeros(7), True, 0.0, settled=False, around=(None, np.zeros(7))
        )

    def restore(self, snapshot: PlannerSnapshot) -> None:
        self.told.append("restore")
        self.plan = snapshot.plan

    def follow(self, plan: JointPlan) -> None:
        self.told.append("follow")
        self.plan = plan

    def resync(self, q: np.ndarray, qd: np.ndarray, time_s: float) -> None:
        self.told.append("resync")
        self.plan = JointPlan(np.array([time_s]), q[None], qd[None], np.zeros((1, 7)))


class Scene:
    """A hand-over with a controller whose reference is set by hand."""

    def __init__(self) -> None:
        self.now_ns = T0
        self.planner = Planner()
        self.inputs = Inputs(radii=np.full(3, 0.05))
        self.handover = Handover(
            self.planner,  # type: ignore[arg-type]
            self.inputs,
            arrival_ns=22 * MS,
            interval_ns=36 * MS,
            lockstep=False,
            now_ns=lambda: self.now_ns,
        )
        self.handover.begin(T0)

    def send(self, plan: JointPlan, due_ns: int) -> None:
        """A plan is sent."""
        before = self.planner.plan
        self.planner.plan = plan
        self.handover.sent(due_ns, before, plan)

    def says(self, now_ns: int, due_ns: int, start_s: float, rate: float = 1.0) -> None:
        """The controller is on the plan that was due then, since then at full speed."""
        in_trajectory = (now_ns - due_ns) * 1e-9
        q = START + SPEED * (start_s + max(in_trajectory, 0.0))
        self.now_ns = now_ns
        self.inputs.reference = ControllerState(
            state=ControllerState.TRACKING,
            reference_position=q,
            reference_velocity=SPEED,
            trajectory=to_time(due_ns),
            time_in_trajectory=in_trajectory,
            speed_scale=rate,
        )
        self.inputs.reference.header.stamp = to_time(now_ns)

    def begin_at(self, handover_ns: int) -> np.ndarray:
        """First point of a plan that goes on from the planner's."""
        assert self.planner.plan is not None
        q: np.ndarray = self.planner.plan.sample(self.handover.plan_time_s(handover_ns))[0]
        return q


@pytest.fixture
def scene() -> Scene:
    """The controller is 100 ms into the first plan."""
    scene = Scene()
    scene.send(path(0.0), T0)
    scene.says(T0 + 100 * MS, T0, 0.0)
    return scene


def test_at_full_speed_a_plan_is_due_at_its_hand_over(scene: Scene) -> None:
    handover_ns = T0 + 136 * MS
    joint = scene.handover.align(handover_ns)
    assert scene.planner.told == []
    begin = scene.begin_at(handover_ns)
    scene.says(T0 + 120 * MS, T0, 0.0)
    assert scene.handover.due_ns(handover_ns, joint, begin) == handover_ns


def test_a_robot_that_was_slowed_since_gets_there_later(scene: Scene) -> None:
    handover_ns = T0 + 136 * MS
    joint = scene.handover.align(handover_ns)
    begin = scene.begin_at(handover_ns)
    scene.says(T0 + 110 * MS, T0, 0.0, rate=0.5)
    scene.now_ns += 10 * MS
    due_ns = scene.handover.due_ns(handover_ns, joint, begin)
    # Taken 2 ms before it is sent; the 8 ms until then count half.
    assert due_ns == pytest.approx(handover_ns + 4 * MS, abs=1000)


@pytest.mark.parametrize(("off", "sent"), [(0.5 * OFF_PATH_RAD, True), (2.0 * OFF_PATH_RAD, False)])
def test_a_plan_that_begins_where_the_robot_will_not_be_is_not_sent(
    scene: Scene, off: float, sent: bool
) -> None:
    handover_ns = T0 + 136 * MS
    begin = scene.begin_at(handover_ns) + off
    assert (scene.handover.due_ns(handover_ns, None, begin) is not None) == sent
    assert scene.handover.off_path == (not sent)


def test_from_rest_a_plan_begins_where_the_robot_stands() -> None:
    scene = Scene()
    scene.says(T0, T0, 0.0)
    assert scene.inputs.reference is not None
    scene.inputs.reference.state = ControllerState.IDLE
    assert scene.handover.due_ns(T0 + 36 * MS, None, START) == T0 + 36 * MS
    assert scene.handover.due_ns(T0 + 36 * MS, None, START + 0.01) is None


def test_where_no_controller_speaks_all_is_sent() -> None:
    assert Scene().handover.due_ns(T0 + 36 * MS, None, START + 1.0) == T0 + 36 * MS


@pytest.mark.parametrize("late_ns", [MAX_LATENESS_NS - MS, MAX_LATENESS_NS + MS])
def test_a_plan_that_was_lost(scene: Scene, late_ns: int) -> None:
    """The second plan turns off the first and is never taken."""
    second_ns = T0 + 136 * MS
    scene.send(path(0.136, turn=0.3), second_ns)
    said_ns = second_ns + late_ns
    scene.says(said_ns, T0, 0.0)
    handover_ns = said_ns + 36 * MS
    joint = scene.handover.align(handover_ns)
    begin = scene.begin_at(handover_ns)
    if late_ns < MAX_LATENESS_NS:
        # It may still be taken: what is built on it is not sent before it has been.
        assert (joint, scene.planner.told, scene.handover.follows_a_plan) == (None, [], False)
        assert scene.handover.due_ns(handover_ns, joint, begin) is None
        return
    assert scene.planner.told == ["restore", "follow"]
    assert scene.handover.follows_a_plan
    np.testing.assert_allclose(begin, START + SPEED * (handover_ns - T0) * 1e-9, atol=1e-9)
    assert scene.handover.due_ns(handover_ns, joint, begin) == handover_ns
    scene.handover.align(handover_ns)
    assert scene.handover.not_followed == 1  # counted once


def test_the_first_plan_of_a_new_motion_is_lost(scene: Scene) -> None:
    """The robot stays on the motion before, and the next plan begins there."""
    begin_ns = T0 + 136 * MS
    state = scene.handover.state_at(begin_ns)
    assert state is not None
    scene.planner.plan = path(0.0, turn=0.3)  # the new goal's, on a clock that is zero at its begin
    scene.handover.begin(begin_ns)
    assert scene.handover.align(begin_ns) is None
    assert scene.planner.told == []

    scene.says(begin_ns, T0, 0.0)  # dropped as late: nothing was sent
    handover_ns = begin_ns + 36 * MS
    joint = scene.handover.align(handover_ns)
    assert scene.planner.told == ["resync"]
    begin = scene.begin_at(handover_ns)
    np.testing.assert_allclose(begin, START + SPEED * 0.172, atol=1e-9)
    assert scene.handover.due_ns(handover_ns, joint, begin) == handover_ns
