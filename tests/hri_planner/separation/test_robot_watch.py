"""What the monitor finds out about the robot: joint speeds that are not true, paths that ask for more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_planner.separation.robot_watch import FORTH, JointWatch, PathWatch

MS = 1_000_000


def watched(scale: float, frequency: float = 1.0, offset: float = 0.0) -> list[float]:
    """How far speeds are apart that a driver scales, of joints that swing [rad/s]."""
    watch, found = JointWatch(0.15), []
    phases = np.arange(7.0)
    for ms in range(0, 1000, 4):
        angle = 2.0 * np.pi * frequency * ms * 1e-3 + phases
        q = 0.3 * np.sin(angle)
        qd = 0.3 * 2.0 * np.pi * frequency * np.cos(angle)
        watch.take(ms * MS, q, scale * qd + offset)
        found.append(watch.apart)
    return found


@given(st.floats(0.1, 1.5))
def test_true_speeds_are_believed(frequency: float) -> None:
    assert max(watched(1.0, frequency)) < 0.01


@pytest.mark.parametrize("scale", [0.0, 0.5, np.degrees(1.0)])
def test_speeds_that_contradict_the_angles_are_told(scale: float) -> None:
    """Zeros, and those in degrees."""
    fastest = 0.3 * 2.0 * np.pi
    assert max(watched(scale)) == pytest.approx(abs(1.0 - scale) * fastest, rel=0.05)


def test_which_joint_it_is() -> None:
    watch = JointWatch(0.15)
    for ms in range(0, 40, 4):
        q = np.zeros(7)
        q[4] = 0.2 * ms * 1e-3
        watch.take(ms * MS, q, np.zeros(7))
    assert watch.contradicts
    assert watch.joint == 4
    watch.restart()
    assert not watch.contradicts


def test_stamps_that_stay_or_go_back_make_no_contradiction() -> None:
    watch = JointWatch(0.15)
    for stamp_ms in (100, 104, 104, 108, 20, 24, 28, 32, 36, 40, 44, 48):
        watch.take(stamp_ms * MS, np.full(7, stamp_ms * 1e-3), np.ones(7))
        assert not watch.contradicts


def mixed(watch: JointWatch, stamps_ms: list[int], angles: list[float]) -> list[bool]:
    told = []
    for stamp_ms, angle in zip(stamps_ms, angles, strict=True):
        watch.take(stamp_ms * MS, np.full(7, angle), np.zeros(7))
        told.append(watch.mixed)
    return told


@pytest.mark.parametrize("late_ms", [7, 20, 45, 1000])
@pytest.mark.parametrize("at_once", [1, 2, 4])
def test_two_sources_whose_stamps_go_back_and_forth_are_told(late_ms: int, at_once: int) -> None:
    """However many joint states of each are handed over at a time, in the order of their stamps."""
    watch = JointWatch(0.15)
    stamps: list[int] = []
    for tick in range(2000, 2400, 4 * at_once):
        new = [tick + 4 * k for k in range(at_once)]
        stamps += sorted([*new, *(stamp - late_ms for stamp in new)])
    told = mixed(watch, stamps, [0.0] * len(stamps))
    assert all(told[6 * at_once :])
    # One of them has ended.
    alone = mixed(watch, list(range(3000, 3200, 4)), [0.0] * 50)
    assert alone[0]
    assert not any(alone[FORTH:])


def test_two_sources_on_one_grid_of_stamps_are_told_by_their_angles() -> None:
    twice = [stamp for stamp in range(100, 200, 4) for _ in range(2)]
    assert not any(mixed(JointWatch(0.15), twice, [0.0] * 50))
    watch = JointWatch(0.15)
    assert all(mixed(watch, twice, [0.0, 0.05] * 25)[1:])
    watch.restart()
    assert not watch.mixed


def test_two_sources_with_stamps_in_between_are_told_by_their_angles() -> None:
    """One 2 ms after the other, equally late: the stamps of both together only go on."""
    stamps = list(range(100, 300, 2))
    watch = JointWatch(0.15)
    assert all(mixed(watch, stamps, [0.0, 0.05] * 50)[1:])
    alone = mixed(watch, list(range(300, 500, 4)), [0.0] * 50)
    assert not any(alone[FORTH:])


@given(st.floats(0.0, 2.0), st.integers(4, 400))
def test_a_joint_that_turns_is_no_second_source(speed: float, step_ms: int) -> None:
    watch = JointWatch(0.15)
    for ms in range(0, 4000, step_ms):
        watch.take(ms * MS, np.full(7, speed * ms * 1e-3), np.full(7, speed))
        assert not watch.mixed


def test_a_clock_that_goes_back_once_is_no_second_source() -> None:
    stamps = [*range(1000, 1100, 4), *range(500, 640, 4), *range(300, 400, 4)]
    assert not any(mixed(JointWatch(0.15), stamps, [0.0] * len(stamps)))


def test_a_jump_is_a_contradiction_for_as_long_as_the_window() -> None:
    watch, told = JointWatch(0.15), []
    for ms in range(0, 200, 4):
        watch.take(ms * MS, np.full(7, 0.1 if ms >= 100 else 0.0), np.zeros(7))
        told.append(watch.contradicts)
    assert [4 * k for k, each in enumerate(told) if each] == [100, 104, 108, 112, 116]


@given(st.floats(0.3, 1.0))
def test_gains_are_those_of_the_path_at_whatever_rate(rate: float) -> None:
    watch, path_s = PathWatch(), 0.0
    for ms in range(0, 1000, 8):
        speed = 5.0 * path_s
        watch.take(ms * MS, rate, np.array([[speed, 0.0, 0.0], [0.0, 0.0, 0.0]]))
        path_s += 8e-3 * rate
    assert watch.gained == pytest.approx(5.0, rel=1e-6)
    assert watch.fastest == pytest.approx(speed)


def test_a_path_that_is_not_known_for_a_while_begins_anew() -> None:
    watch = PathWatch()
    for ms in range(0, 400, 8):
        known = ms not in range(160, 240)
        speed = 0.0 if ms < 200 else 1.0
        watch.take(ms * MS, 1.0, np.array([[speed, 0.0, 0.0]]) if known else None)
    assert watch.gained == 0.0
