"""Goals that change while the robot is on its way to them, as the demo scenes of policies have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.partner import Partner
from hri_prediction.errors import ConfigError
from hri_sim.scenario.conditions import draw_scenario
from hri_sim.scenario.schema import Scenario

FloatArray = NDArray[np.float64]

SCENES = {
    "sequence": "goals one after the other, while the person reaches through the same space",
    "switch": "each goal is changed to another one in mid-flight",
    "handover": "the goal stays in front of the person's moving hand",
}

SWITCH_AFTER_S = 0.5
"""From the begin of a motion to the change of its goal [s]."""

HANDOVER_M = 0.24
"""Distance of the tool's goal from the person's hand tip, towards the robot [m]."""
RAISED_M = 0.08
"""By so much higher, until the person holds the hand out [m]: nothing is reached before that."""

CLEAR_M = 0.24
"""Goals that change are changed to such as are so far from the person's arm at rest [m]."""

HELD_OUT_M = ((0.50, 0.62), (-0.20, 0.20), (0.15, 0.30))
"""Where people hold things out: ranges of x, y and z [m]."""

_SHOULDER_HEIGHT_M = 0.31
_TRIES = 200

Leader = Callable[[int, float, FloatArray | None], FloatArray | None]
"""Where the goal of a reach (its number) is, so long after its begin [s], with the hand of its person
(3,) [m] where that is seen: (3,) [m]; none: where it was."""


@dataclass(frozen=True, eq=False)
class Scene:
    """What is conducted.

    Attributes:
        scenario: Reaches with their first goals.
        leader: Moves the goals; none: they stay.
    """

    scenario: Scenario
    leader: Leader | None = None


def draw_scene(name: str, seed: int, reaches: int) -> Scene:
    """A demo scene, one of :data:`SCENES`.

    Args:
        name: Of the scene.
        seed: Draws people and places.
        reaches: How many.

    Raises:
        ConfigError: when the scenario cannot be drawn.
    """
    if name == "switch":
        drawn = draw_scenario(seed, 2 * reaches)
        # The robot never gets to the first goal of each pair; the person does all of them.
        later = [_other_goal(drawn, index) for index in range(0, 2 * reaches, 2)]
        kept = tuple(reach.model_copy(update={"start": 0.0}) for reach in drawn.reaches[::2])
        scenario = drawn.model_copy(update={"reaches": kept, "name": f"switch_{seed}"})
        return Scene(scenario, _switch(later))
    if name == "handover":
        scenario = _handed_over(draw_scenario(seed, reaches), seed)
        return Scene(scenario, _in_front_of_hand(scenario))
    return Scene(draw_scenario(seed, reaches))


def _other_goal(drawn: Scenario, index: int) -> FloatArray:
    """A goal (3,) [m] that the one of a reach may change to: the next clear of where the person rests.

    Where none is, the one that is farthest from there.
    """
    reach, person = drawn.reaches[index], drawn.person_of(index)
    following = [*drawn.reaches[index + 1 :], *drawn.reaches[:index]]
    names = dict.fromkeys(one.robot_target for one in following)
    places = [np.array(drawn.targets[name]) for name in names if name != reach.robot_target]
    if reach.person_target is None:
        return places[0]
    arm = person.arm.posture(np.array(drawn.targets[reach.person_target]), person.swivel)
    resting = Partner(arm[-1], np.zeros(3), joints=arm, speeds=np.zeros_like(arm))
    apart = [resting.distance(place) for place in places]
    clear = (place for place, far in zip(places, apart, strict=True) if far >= CLEAR_M)
    return next(clear, places[int(np.argmax(apart))])


def _handed_over(drawn: Scenario, seed: int) -> Scenario:
    """The same with people who hold things out to the robot, where it can get at them."""
    rng = np.random.default_rng(seed)
    targets = dict(drawn.targets)
    low, high = np.array(HELD_OUT_M).T
    for index, reach in enumerate(drawn.reaches):
        if reach.person_target is None:
            continue
        arm = drawn.person_of(index).arm
        places = rng.uniform(low, high, (_TRIES, 3))
        found = next((place for place in places if arm.can_reach(place)), None)
        if found is None:
            raise ConfigError(
                f"--seed {seed}: the person cannot hold anything out to the robot",
                hint="take another seed",
            )
        x, y, z = (round(float(value), 3) for value in found)
        targets[reach.person_target] = (x, y, z)
    return drawn.model_copy(update={"targets": targets, "name": f"handover_{seed}"})


def _switch(later: list[FloatArray]) -> Leader:
    def lead(index: int, elapsed_s: float, hand: FloatArray | None) -> FloatArray | None:
        return later[index] if elapsed_s >= SWITCH_AFTER_S else None

    return lead


def _in_front_of_hand(scenario: Scenario) -> Leader:
    held_out_s = [reach.person_delay + reach.person_duration for reach in scenario.reaches]

    def lead(index: int, elapsed_s: float, hand: FloatArray | None) -> FloatArray | None:
        if hand is None:
            return None
        away = np.array((0.0, 0.0, _SHOULDER_HEIGHT_M)) - hand
        goal: FloatArray = hand + HANDOVER_M * away / float(np.linalg.norm(away))
        if elapsed_s < held_out_s[index]:
            goal[2] += RAISED_M
        return goal

    return lead
