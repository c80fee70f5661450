"""What hands and keys say is taken as it was meant, from wherever the hand set out."""

import numpy as np
import pytest

from hri_planner.pibb.recording import (
    NANO,
    STILL_M,
    AnswerConfig,
    Recording,
    Stirring,
    check_clock,
)
from hri_planner.robot.model import load_robot
from hri_prediction.errors import DataError

ROBOT = load_robot()
HOME = np.array((0.93, 0.27, 0.05))
TARGETS = {"left": np.array((0.74, 0.32, 0.04)), "right": np.array((0.76, -0.26, 0.04))}
PERIOD_S = 0.01


def bell(u: np.ndarray | float) -> np.ndarray:
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 + u * (-15.0 + 6.0 * u))


def reach(begin: np.ndarray, end: np.ndarray, start_s: float, seconds: float):
    """A minimum-jerk motion, as a function of time [s]."""
    return lambda t: begin + float(bell((t - start_s) / seconds)) * (end - begin)


def recorded(place, until_s: float, noise_m: float = 0.0, seed: int = 0) -> Recording:
    rng, recording = np.random.default_rng(seed), Recording(ROBOT, TARGETS, AnswerConfig())
    for time in np.arange(0.0, until_s, PERIOD_S):
        recording.hand("ann", round(time * NANO), place(time) + noise_m * rng.standard_normal(3))
    return recording


@pytest.mark.parametrize("seconds", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("noise_m", [0.0, 0.001])
@pytest.mark.parametrize("name", list(TARGETS))
def test_a_reach_is_an_answer_and_lasts_as_long_as_it_is_fast(
    name: str, seconds: float, noise_m: float
) -> None:
    answer = recorded(reach(HOME, TARGETS[name], 1.0, seconds), 3.0, noise_m).answer
    assert answer is not None
    assert answer.goal == name
    # The speed of 0.15 m/s is passed some time after the beginning, and again before the end.
    length = np.linalg.norm(TARGETS[name] - HOME)
    u = np.linspace(0.0, 1.0, 10001)
    fast = u[30.0 * length / seconds * (u * (1.0 - u)) ** 2 > AnswerConfig().hand_speed]
    assert answer.hand_s == pytest.approx(seconds * (fast[-1] - fast[0]), abs=0.05)
    assert answer.stamp_ns / NANO == pytest.approx(1.0 + seconds * fast[-1], abs=0.06)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8, 1.0])
def test_where_the_hand_set_out_does_not_change_how_long_its_motion_was(share: float) -> None:
    """Still on its way back from the last target when the trial began."""
    begin = TARGETS["right"] + share * (HOME - TARGETS["right"])
    back, there = reach(begin, HOME, 0.0, 0.4), reach(HOME, TARGETS["left"], 1.0, 0.7)
    answer = recorded(lambda t: back(t) if t < 0.8 else there(t), 3.0).answer
    alone = recorded(there, 3.0).answer
    assert answer is not None
    assert alone is not None
    assert answer.goal == "left"
    assert answer.hand_s == pytest.approx(alone.hand_s, abs=0.011)


def test_a_hand_that_passes_by_or_stops_elsewhere_is_no_answer() -> None:
    beyond = TARGETS["left"] + 2.0 * (TARGETS["left"] - HOME)
    assert recorded(reach(HOME, beyond, 0.5, 0.8), 1.2).answer is None
    short = HOME + 0.5 * (TARGETS["left"] - HOME)
    assert recorded(reach(HOME, short, 0.5, 0.8), 3.0).answer is None


def test_samples_out_of_order_and_lone_ones_say_nothing() -> None:
    recording = Recording(ROBOT, TARGETS, AnswerConfig())
    recording.hand("ann", NANO, TARGETS["left"])
    assert recording.answer is None, "how fast it is nobody knows"
    recording.hand("ann", NANO // 2, TARGETS["left"])
    assert recording.answer is None
    recording.hand("ann", NANO + 50_000_000, TARGETS["left"])
    assert recording.answer is not None
    assert recording.answer.hand_s == 0.0, "it was there already"


def test_keys_count_from_the_start_of_the_robot_and_the_first_does() -> None:
    recording = Recording(ROBOT, {}, AnswerConfig())
    with pytest.raises(DataError, match="before the robot moved"):
        recording.press("left", 5)
    recording.begin(10)
    recording.press("left", 30)
    recording.press("right", 40)
    recording.press("right", 20)  # an earlier one that comes later
    assert recording.answer is not None
    assert (recording.answer.goal, recording.answer.stamp_ns) == ("right", 20)


def test_stamps_of_the_future_are_refused() -> None:
    check_clock("a hand", 10 * NANO, 10 * NANO)
    with pytest.raises(DataError, match=r"3600\.00 s ahead of the clock"):
        check_clock("a hand", 3610 * NANO, 10 * NANO)


def test_hands_stir_only_beside_the_targets_and_when_they_move() -> None:
    stirring = Stirring(TARGETS.values())
    assert stirring.since(5 * NANO) == 5 * NANO
    stirring.hand("far", NANO, np.array((3.0, 3.0, 1.0)))
    assert stirring.since(5 * NANO) == 5 * NANO
    stirring.hand("ann", NANO, HOME)
    stirring.hand("ann", 3 * NANO, HOME + np.array((0.9 * STILL_M, 0.0, 0.0)))
    assert stirring.since(5 * NANO) == 4 * NANO
    stirring.hand("ann", 4 * NANO, HOME + np.array((1.1 * STILL_M, 0.0, 0.0)))
    assert stirring.since(5 * NANO) == NANO
    nobody = Stirring(())
    nobody.hand("ann", NANO, HOME)
    assert nobody.since(5 * NANO) == 5 * NANO


def test_a_hand_that_was_there_before_a_key_counts_though_it_is_heard_of_later() -> None:
    place = reach(HOME, TARGETS["left"], 0.2, 0.5)
    recording = Recording(ROBOT, TARGETS, AnswerConfig())
    recording.begin(0)
    late = [(round(time * NANO), place(time)) for time in np.arange(0.0, 1.5, PERIOD_S)]
    for stamp_ns, tip in late[:30]:
        recording.hand("ann", stamp_ns, tip)
    recording.press("right", round(1.4 * NANO))
    assert recording.answer is not None
    assert recording.answer.goal == "right"
    for stamp_ns, tip in late[30:]:
        recording.hand("ann", stamp_ns, tip)
    assert recording.answer.goal == "left"
