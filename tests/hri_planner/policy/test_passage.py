"""The hand along a plan, as a robot finds it that is late or slow."""

import numpy as np
import pytest

from hri_planner.policy.hand import HandState
from hri_planner.policy.passage import Passage

DT = 0.004
ACCELERATION = np.array((0.5, -1.0, 2.0))


def hand(step: int) -> HandState:
    """Of a motion of constant acceleration whose network is asked each eight steps."""
    time = step * DT
    return HandState(
        position=0.5 * ACCELERATION * time**2,
        velocity=ACCELERATION * time,
        acceleration=ACCELERATION,
        filtered=False,
        memory=np.array((float(step // 8),)),
        wanted=ACCELERATION,
        count=step % 8,
    )


PASSAGE = Passage(tuple(hand(step) for step in range(17)), DT, 0.100)


@pytest.mark.parametrize("steps", [0.0, 0.3, 2.4, 2.6, 7.9, 16.0, -0.4, -1.5])
def test_the_place_is_that_of_the_moment(steps: float) -> None:
    found, ahead = PASSAGE.at(0.100 - steps * DT)
    time = steps * DT
    assert found.position == pytest.approx(0.5 * ACCELERATION * time**2, abs=1e-12)
    assert found.velocity == pytest.approx(ACCELERATION * time)
    assert found.count == max(round(steps), 0) % 8
    assert max(round(steps), 0) + ahead == pytest.approx(steps)


@pytest.mark.parametrize("advance", [0.13, 0.48, 0.8, 2.4, 5.0, 7.7])
def test_the_network_is_asked_by_the_way_whatever_the_speed(advance: float) -> None:
    """Plan after plan, each of which begins a little after the one before."""
    ahead, count, asked = 0.0, 0, 0
    cycles = round(800 / advance)
    for _ in range(cycles):
        plan = Passage(tuple(hand(count + step) for step in range(17)), DT, 0.1, ahead)
        found, ahead = plan.at(0.100 - advance * DT)
        asked += round(
            found.memory[0]
        )  # since the network of this plan's first hand, whose count is < 8
        count = found.count
    assert asked == pytest.approx(cycles * advance / 8, abs=1.1)


def test_elsewhere_nothing_is_known() -> None:
    for steps in (-3.0, 17.0, 30.0):
        with pytest.raises(LookupError):
            PASSAGE.at(0.100 - steps * DT)
