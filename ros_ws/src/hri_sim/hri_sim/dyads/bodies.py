"""The two people of a dyad as bodies that motion capture sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import ValidationError

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError
from hri_prediction.tracks.placement import Placement
from hri_sim.dyads.arms import SeatedArm
from hri_sim.dyads.hands import STEP_S
from hri_sim.dyads.motion import DyadMotion
from hri_sim.people.capture import CapturedArm
from hri_sim.people.seeding import tracking_generator
from hri_sim.people.tracking import TrackingModel
from hri_sim.scenario.schema import PersonSpec

AHEAD = 8
"""Steps of an arm that are found out at once: many cost hardly more than one."""


def named_person(name: str) -> PersonSpec:
    """Somebody of this name, with the usual arm and tracking.

    Raises:
        ConfigError: when a body cannot have this name.
    """
    try:
        return PersonSpec(id=name)
    except ValidationError as error:
        raise ConfigError(
            f"body {name!r}", expected="a letter, then letters, digits and _"
        ) from error


def dyad_bodies(
    motion: DyadMotion, ids: Sequence[str], seed: int, place: Placement
) -> dict[str, list[CapturedArm]]:
    """The arm of each of the two, by name.

    Args:
        motion: What their hands do.
        ids: Names of learner and partner.
        seed: Of the tracking.
        place: Where the middle of the table top is in the world.

    Raises:
        ConfigError: when a body cannot have such a name.
    """
    found = {}
    for person, name in enumerate(ids):
        spec = named_person(name)
        arm = SeatedArm(motion.setup.shoulders[person], float(motion.setup.yaw[person]))
        truth = _Truth(motion, person, arm, place)
        tracking = TrackingModel(spec, tracking_generator(seed, name))
        found[name] = [CapturedArm(truth, spec.side, tracking)]
    return found


class _Truth:
    """Where an arm is at a time, found out some steps ahead: so is what the motion says of encounters.

    Args:
        motion: What the hands do.
        person: Whose arm it is, 0 or 1.
        arm: How it is held.
        place: Where the middle of the table top is in the world.
    """

    def __init__(self, motion: DyadMotion, person: int, arm: SeatedArm, place: Placement) -> None:
        self._motion, self._person, self._arm, self._place = motion, person, arm, place
        self._first = 0
        self._known: FloatArray = np.empty((0, 4, 3))

    def __call__(self, seconds: float) -> FloatArray:
        """Keypoints (4, 3) [m] at a time, world frame."""
        step = round(seconds / STEP_S)
        if not 0 <= step - self._first < len(self._known):
            hands = [self._motion.at(step + ahead)[self._person] for ahead in range(AHEAD)]
            self._known = np.asarray(self._place.apply(self._arm.keypoints(np.array(hands))))
            self._first = step
        found: FloatArray = self._known[step - self._first]
        return found
