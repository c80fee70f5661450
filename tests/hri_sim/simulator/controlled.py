"""What is known of a controller under test: its robot, trajectories, and a clock that drives it."""

import numpy as np

from hri_planner.robot import load_robot
from hri_sim.simulator import ControllerConfig, JointTrajectory, TrajectoryController

ROBOT = load_robot()
NAMES = ROBOT.joint_names
START = np.array([0.5, -0.6, 0.0, 1.4, 0.0, -0.9, 0.0])
STEP = 1_000_000


def min_jerk(start, end, duration=1.5, count=43, stamp_ns=STEP, kind="quintic"):
    t = np.linspace(0.0, duration, count)
    x = (t / duration)[:, None]
    s = 10 * x**3 - 15 * x**4 + 6 * x**5
    v = (30 * x**2 - 60 * x**3 + 30 * x**4) / duration
    a = (60 * x - 180 * x**2 + 120 * x**3) / duration**2
    move = np.asarray(end) - start
    return JointTrajectory(
        stamp_ns,
        NAMES,
        t,
        start + s * move,
        v * move if kind != "linear" else None,
        a * move if kind == "quintic" else None,
    )


class Run:
    """A controller on a 1 kHz clock, with what it asked for."""

    def __init__(self, q=START, heartbeat=None, **config):
        self.controller = TrajectoryController(ROBOT, ControllerConfig(**config))
        self.controller.reset(q, 0)
        self.now = 0
        self.heartbeat = heartbeat
        self.q, self.qd, self.qdd, self.scale = [], [], [], []

    def go(self, seconds):
        for _ in range(round(seconds * 1000)):
            self.now += STEP
            if self.heartbeat is not None and self.now % 20_000_000 == 0:
                self.controller.chain.command(self.heartbeat, self.now)
            self.controller.step(self.now)
            self.q.append(self.controller.q_ref.copy())
            self.qd.append(self.controller.qd_ref.copy())
            self.qdd.append(self.controller.qdd_ref.copy())
            self.scale.append(self.controller.scale)
        return self

    def assert_continuous(self, acceleration=60.0):
        q, qd = np.array(self.q), np.array(self.qd)
        assert np.abs(np.diff(qd, axis=0)).max() <= acceleration * 1e-3
        # The positions move as the velocities say.
        assert np.abs(np.diff(q, axis=0) - qd[:-1] * 1e-3).max() <= 0.6 * acceleration * 1e-6


END = START + np.array([-1.0, 0.3, 0.4, -0.5, 0.2, 0.3, 0.5])
