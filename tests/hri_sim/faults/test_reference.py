"""Jumps and limits of the reference are found, and motion is none."""

from __future__ import annotations

import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_sim.faults.processes import PROCESS_FAULTS
from hri_sim.faults.reference import BEYOND, JUMP, Asked, on_course, worse

ROBOT = load_robot()


def moving(seconds: float = 2.0) -> list[Asked]:
    """Swings of all joints, at up to 1.9 rad/s."""
    found = []
    for stamp_s in np.arange(0.0, seconds, 0.004):
        q = np.full(7, 0.6 * np.sin(np.pi * stamp_s))
        qd = np.full(7, 0.6 * np.pi * np.cos(np.pi * stamp_s))
        found.append(Asked(float(stamp_s), q, qd))
    return found


def test_motion_is_no_jump() -> None:
    figures = on_course(moving(), ROBOT)
    assert figures[JUMP.key] == pytest.approx(0.0, abs=1e-6)
    assert figures[BEYOND.key] == 0.0


def test_a_jump_that_is_less_than_a_step_of_the_motion_is_found() -> None:
    asked = moving()
    jumped = [
        Asked(a.stamp_s, a.q + (0.005 if n >= 100 else 0.0), a.qd) for n, a in enumerate(asked)
    ]
    assert on_course(jumped, ROBOT)[JUMP.key] == pytest.approx(0.005, abs=1e-6)
    # What was not heard in between is no step.
    assert on_course([*asked[:100], *jumped[110:]], ROBOT)[JUMP.key] == pytest.approx(0.0, abs=1e-6)


def test_limits_and_numbers() -> None:
    asked = moving(0.1)
    beyond = asked[3]._replace(q=ROBOT.upper + 1e-6 * np.eye(7)[2])
    none = asked[5]._replace(q=np.full(7, np.nan))
    speedless = asked[6]._replace(qd=np.full(7, np.inf))
    assert on_course([beyond, none, speedless, asked[9]], ROBOT)[BEYOND.key] == 3.0


def test_of_what_was_not_heard_nothing_is_told_and_that_is_a_miss() -> None:
    nothing = on_course([], ROBOT)
    assert nothing == {JUMP.key: None, BEYOND.key: None}
    assert not JUMP.met(nothing[JUMP.key])
    assert not BEYOND.met(nothing[BEYOND.key])
    # Of references that do not follow each other no jump is told.
    apart = on_course(moving(0.1)[::2], ROBOT)
    assert apart == {JUMP.key: None, BEYOND.key: 0.0}
    heard = {JUMP.key: 1e-3, BEYOND.key: 2.0}
    assert worse(heard, {JUMP.key: 2e-3, BEYOND.key: 1.0}) == {JUMP.key: 2e-3, BEYOND.key: 2.0}
    assert worse(heard, nothing) == worse(nothing, heard) == nothing


def test_a_reference_that_dies_with_its_robot_is_no_figure_of_that_line() -> None:
    wanted = {fault.name: set(fault.figures) for fault in PROCESS_FAULTS}
    assert {name for name, figures in wanted.items() if JUMP not in figures} == {"kill_simulator"}
    assert {name for name, figures in wanted.items() if BEYOND not in figures} == {"kill_simulator"}
