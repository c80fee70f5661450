"""Offline trials of the planner: a person reaches through the robot's way, imperfectly foreseen.

Run as a script for statistics: ``python reach_trials.py FIRST COUNT``.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np

from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner, TableBox
from hri_planner.ptomp.plan import connect
from hri_planner.robot import load_robot
from hri_planner.robot.ik import solve_ik
from hri_prediction.geometry import capsule_distances

ROBOT = load_robot()
TABLE = TableBox((0.55, 0.0, -0.03), (0.9, 1.4, 0.04))
RADII = np.array([0.05, 0.04, 0.05])
INTERVAL = 1.5 / 42
REST = np.radians([0.0, -35.0, 0.0, 95.0, 0.0, -50.0, 0.0])


def progress(t, duration):
    """Minimum jerk from 0 to 1."""
    x = np.clip(np.asarray(t, dtype=float) / duration, 0.0, 1.0)
    return x**3 * (10 - 15 * x + 6 * x * x)


def arm(shoulder, hand):
    """Shoulder, elbow (hanging), wrist and hand tip (n, 4, 3) for hand tips (n, 3)."""
    hand = np.atleast_2d(hand)
    to_hand = hand - shoulder
    wrist = hand - 0.09 * to_hand / np.linalg.norm(to_hand, axis=1, keepdims=True)
    axis = wrist - shoulder
    reach = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / reach
    reach = np.minimum(reach, 0.549)
    wrist = shoulder + reach * axis
    along = (0.29**2 - 0.26**2 + reach**2) / (2 * reach)
    aside = np.sqrt(np.maximum(0.29**2 - along**2, 0.0))
    down = np.array([0.0, 0.0, -1.0]) - axis * axis[:, 2:] * -1.0
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    elbow = shoulder + along * axis + aside * down
    tip = wrist + 0.09 * axis
    start = np.broadcast_to(shoulder, wrist.shape)
    return np.stack((start, elbow, wrist, tip), axis=1)


@dataclass(frozen=True)
class Condition:
    """One reach of robot and person."""

    q_start: np.ndarray
    goal: np.ndarray
    shoulder: np.ndarray
    home: np.ndarray
    target: np.ndarray
    delay: float
    duration: float

    def hand(self, t):
        """True hand tip (n, 3)."""
        s = progress(np.atleast_1d(t) - self.delay, self.duration)[:, None]
        lift = 4 * s * (1 - s) * np.array([0.0, 0.0, 0.03])
        return self.home + s * (self.target - self.home) + lift

    def clearance(self, q, t):
        """True clearance at configurations (n, 7) and times (n,)."""
        robot = ROBOT.robot_capsules(q)
        people = arm(self.shoulder, self.hand(t))
        axes = np.stack((people[:, :-1], people[:, 1:]), axis=2)
        return np.array(
            [
                capsule_distances(r, ROBOT.capsule_radii, p, RADII).min()
                for r, p in zip(robot, axes, strict=True)
            ]
        )


def draw_condition(rng):
    """A condition whose plain motion collides but whose ends are clear; nothing else is asked."""
    while True:
        side = rng.choice([-1.0, 1.0])
        y0, y1 = side * rng.uniform(0.25, 0.5), -side * rng.uniform(0.25, 0.5)
        start = np.array([rng.uniform(0.3, 0.6), y0, rng.uniform(0.08, 0.30)])
        goal = np.array([rng.uniform(0.3, 0.6), y1, rng.uniform(0.08, 0.30)])
        shoulder = np.array(
            [rng.uniform(0.68, 0.85), rng.uniform(-0.2, 0.2), rng.uniform(0.36, 0.44)]
        )
        home = shoulder + np.array(
            [-rng.uniform(0.1, 0.2), rng.uniform(-0.1, 0.1), -rng.uniform(0.22, 0.3)]
        )
        target = np.array(
            [rng.uniform(0.33, 0.60), rng.uniform(-0.25, 0.25), rng.uniform(0.08, 0.22)]
        )
        if np.linalg.norm(target - shoulder) > 0.62:
            continue
        q_start = solve_ik(ROBOT, start, REST, rng)
        q_goal = solve_ik(ROBOT, goal, q_start, rng)
        condition = Condition(
            q_start, goal, shoulder, home, target, rng.uniform(0.0, 0.5), rng.uniform(1.0, 1.7)
        )
        t = np.linspace(0, 1.5, 76)
        q, qd, _ = connect((q_start, np.zeros(7), np.zeros(7)), q_goal, 1.5, t)
        heights = ROBOT.frames(q)[:, 1:, 2] - np.array([0.07, 0.07, 0.06])
        if heights.min() < TABLE.top + 0.005 or np.any(np.abs(qd) > 0.9 * ROBOT.velocity):
            continue
        clearance = condition.clearance(q, t)
        after = np.linspace(1.5, 2.6, 23)
        rest = condition.clearance(np.repeat(q_goal[None], len(after), 0), after)
        if clearance.min() < 0.0 and clearance[0] >= 0.10 and rest.min() >= 0.03:
            return condition


class Foresight:
    """Forecasts of one trial: still before onset, then a target error that fades with the reach."""

    def __init__(self, condition, rng):
        self.condition = condition
        self.bias = rng.standard_normal(3)
        self.rush = 1.0 + 0.1 * rng.standard_normal()
        self.rng = rng

    def at(self, now):
        """Forecast with what is known at a time."""
        c = self.condition
        seen = now - c.delay - 0.06
        steps = np.arange(0.0, 2.6, 0.04)
        if seen <= 0.0:
            mean = arm(c.shoulder, np.repeat(c.hand(now), len(steps), 0))
            return HumanForecast(now, 0.04, mean, np.full((len(steps), 4), 0.01), RADII)
        done = min(seen / c.duration, 1.0)
        sd = 0.10 * np.exp(-4.0 * done) + 0.003
        pace = 1.0 + (self.rush - 1.0) * (1.0 - done)
        hand = c.hand(now + steps * pace)
        start = progress(now - c.delay, c.duration)
        ahead = progress(now + steps * pace - c.delay, c.duration)
        share = (ahead - start) / max(1.0 - start, 1e-6)
        jitter = 0.15 * self.rng.standard_normal(3)
        hand = hand + (share * sd)[:, None] * (self.bias + jitter)
        sigma = np.zeros((len(steps), 4))
        sigma[:, 3] = sigma[:, 2] = 0.004 + share * sd
        sigma[:, 1] = 0.7 * sigma[:, 2]
        return HumanForecast(now, 0.04, arm(c.shoulder, hand), sigma, RADII)


@dataclass(frozen=True)
class Outcome:
    """What became of one trial."""

    clearance: float
    contact_s: float
    arrived_s: float
    error: float
    speed_share: float
    jump: float
    acceleration: float
    table: float
    replan_ms: float
    stages: str

    @property
    def ok(self):
        """No contact and at the goal."""
        return self.clearance > 0.0 and self.error <= 0.01


def run_trial(seed, config=None, iterations=None, limit_s=6.0, interval=INTERVAL, trace=None):
    """One seeded trial."""
    rng = np.random.default_rng(seed)
    condition = draw_condition(rng)
    foresight = Foresight(condition, rng)
    planner = PtompPlanner(
        ROBOT, config or PtompConfig(), np.random.default_rng(seed + 10**6), TABLE
    )
    plan = planner.start(condition.q_start, np.zeros(7), condition.goal, 1.5, 0.0)
    now, nearest, contact, speed, jump, hardest = 0.0, np.inf, np.nan, 0.0, 0.0, 0.0
    lowest = np.inf
    stages, arrived, spent = [], np.nan, []
    while now < limit_s:
        handover = now + interval
        before = planner.plan
        began = time.perf_counter()
        result = planner.replan(handover, [foresight.at(now)], iterations=iterations)
        spent.append(time.perf_counter() - began)
        t = np.arange(now, handover - 1e-9, 0.004)
        q, qd, qdd = plan.sample(t)
        clear = condition.clearance(q, t)
        if clear.min() < nearest:
            nearest, contact = clear.min(), t[clear.argmin()]
        speed = max(speed, float((np.abs(qd) / ROBOT.velocity).max()))
        hardest = max(hardest, float(np.abs(qdd).max()))
        points = ROBOT.frames(q)[:, 1:, 2] - np.array([0.07, 0.07, 0.06])
        lowest = min(lowest, float(points.min()) - TABLE.top)
        old, new = before.sample(handover), result.plan.sample(handover)
        jump = max(
            jump, *(float(np.abs(a - b).max()) for a, b in zip(old[:2], new[:2], strict=True))
        )
        if trace is not None:
            trace.append((now, clear.min(), result))
        plan = result.plan
        stages.append(result.stage)
        now = handover
        if planner.finished(now) and np.isnan(arrived):
            arrived = now
        if not np.isnan(arrived) and now > arrived + 0.6:
            if planner.finished(now):
                break
            arrived = np.nan
    q = plan.sample(now)[0]
    error = float(np.linalg.norm(ROBOT.frames(q)[3] - condition.goal))
    names = "".join(s[0] for i, s in enumerate(stages) if i == 0 or s != stages[i - 1])
    return Outcome(
        float(nearest), float(contact), float(arrived), error, speed, jump, hardest, lowest,
        1e3 * float(np.median(spent)), names,
    )  # fmt: skip


def main():
    """Statistics of many trials."""
    first, count = int(sys.argv[1]), int(sys.argv[2])
    iterations = int(sys.argv[3]) if len(sys.argv) > 3 else None
    outcomes = []
    for seed in range(first, first + count):
        outcome = run_trial(seed, iterations=iterations)
        outcomes.append(outcome)
        if not outcome.ok or outcome.clearance < 0.02:
            print(seed, outcome, flush=True)
    clear = np.array([o.clearance for o in outcomes])
    error = np.array([o.error for o in outcomes])
    arrived = np.array([o.arrived_s for o in outcomes])
    hardest = np.array([o.acceleration for o in outcomes])
    lines = {
        "ok": np.mean([o.ok for o in outcomes]),
        "goal 1 cm": np.mean(error < 0.01),
        "goal 1 mm": np.mean(error < 0.001),
        "clearance > 0, 2, 5 cm": [np.mean(clear > gap) for gap in (0.0, 0.02, 0.05)],
        "arrival p50, p95, max [s]": [np.nanquantile(arrived, p) for p in (0.5, 0.95, 1.0)],
        "acceleration p50, max": [np.median(hardest), hardest.max()],
        "speed share": max(o.speed_share for o in outcomes),
        "jump": max(o.jump for o in outcomes),
        "table": min(o.table for o in outcomes),
        "replan p50, max of medians [ms]": [
            f([o.replan_ms for o in outcomes]) for f in (np.median, np.max)
        ],
    }
    for name, values in lines.items():
        print(f"{name:34s}", *(f"{value:.3g}" for value in np.atleast_1d(values)))


if __name__ == "__main__":
    main()
