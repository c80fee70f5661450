"""What is otherwise than planners and their predictors were made for: tracking, or the person."""

from __future__ import annotations

from dataclasses import dataclass

from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError, PlanningError
from hri_sim.benchmark.conditions import Condition, person_of
from hri_sim.people.changes import change_mind, stop_midway
from hri_sim.people.motion import HandMotion
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.seeding import change_generator
from hri_sim.scenario.conditions import Drawing, draw_candidates
from hri_sim.scenario.schema import Vector3

USUAL, STOPS, CHANGES_TARGET = "usual", "stops", "changes-target"
PEOPLE = {
    USUAL: "the person reaches its target",
    STOPS: "the person stops in mid-reach and stays there",
    CHANGES_TARGET: "the person goes to another target in mid-reach",
}
"""What persons do, and in words."""
MAX_NOISE_MM = 100.0
MAX_LATENCY_MS = 90.0
"""Predictors take samples of more than 100 ms for lost ones (`stale_time`), and the robot would stand."""
SPEEDS = (0.25, 4.0)


@dataclass(frozen=True)
class Variation:
    """What differs from the conditions as they were drawn.

    It says what happens, not what planners know: libraries are learnt from the person as it was drawn,
    and planners keep their settings. Whether a varied condition still makes a collision, or can be
    solved at all, is not looked at.

    Attributes:
        tracking_noise_mm: Standard deviation of each tracked coordinate; none: as drawn [mm].
        latency_ms: From capture to delivery of a sample; none: as drawn [ms].
        person_speed: The person is so many times as fast as it was when its reaches were recorded.
        person: What the person does, one of `PEOPLE`.
    """

    tracking_noise_mm: float | None = None
    latency_ms: float | None = None
    person_speed: float = 1.0
    person: str = USUAL

    def __post_init__(self) -> None:
        """Check the ranges."""
        for option, value, low, high, unit in (
            ("tracking-noise-mm", self.tracking_noise_mm, 0.0, MAX_NOISE_MM, " mm"),
            ("latency-ms", self.latency_ms, 0.0, MAX_LATENCY_MS, " ms"),
            ("person-speed", self.person_speed, *SPEEDS, ""),
        ):
            if value is not None and not low <= value <= high:
                raise ConfigError(f"{option} = {value:g}", expected=f"{low:g} to {high:g}{unit}")
        if self.person not in PEOPLE:
            raise ConfigError(f"person {self.person}", expected="one of " + ", ".join(PEOPLE))

    @property
    def text(self) -> str:
        """In words; ``none`` when nothing differs."""
        parts = []
        if self.tracking_noise_mm is not None:
            parts.append(f"tracking noise of {self.tracking_noise_mm:g} mm")
        if self.latency_ms is not None:
            parts.append(f"tracking {self.latency_ms:g} ms late")
        if self.person_speed != 1.0:
            parts.append(f"the person is {self.person_speed:g} times as fast as it was learnt")
        if self.person != USUAL:
            parts.append(PEOPLE[self.person])
        return ", ".join(parts) or "none"

    def person_in(self, condition: Condition) -> SimulatedPerson:
        """The person of a condition as the reach truly happens; time 0 is the robot's start.

        Raises:
            PlanningError: when there is no other target within the person's reach.
        """
        (spec,) = condition.scenario.persons
        changes: dict[str, float] = {"speed_factor": spec.speed_factor * self.person_speed}
        if self.tracking_noise_mm is not None:
            changes["noise_sd"] = 1e-3 * self.tracking_noise_mm
        if self.latency_ms is not None:
            changes["latency"] = 1e-3 * self.latency_ms
        varied = spec.model_copy(update=changes)
        scenario = condition.scenario.model_copy(update={"persons": (varied,)})
        person = person_of(scenario)
        if self.person == USUAL:
            return person
        (motion,) = person.motions
        assert isinstance(motion, HandMotion)
        rng = change_generator(scenario.seed, varied.id, 0)
        if self.person == STOPS:
            person.divert(stop_midway(motion, rng))
            return person
        drawing = Drawing(rng, load_robot(), varied.side, scenario.table)
        target = _another_target(condition, drawing)
        usual_s = scenario.reaches[0].person_duration / varied.speed_factor
        person.divert(change_mind(varied, motion, target, usual_s, rng))
        return person


AS_DRAWN = Variation()
"""Nothing differs."""


def _another_target(condition: Condition, drawing: Drawing) -> Vector3:
    """Another of the task's targets; where it has but one, another place that it could have had."""
    task = condition.task
    meant = condition.scenario.reaches[0].person_target
    assert meant is not None
    others = [place for name, place in task.targets.items() if name != meant]
    if not others:
        others = draw_candidates(drawing, task.person, task.person.home, task.targets[meant])
    if not others:
        raise PlanningError(f"no other target for task {task.number} of {task.split} was found")
    return others[int(drawing.rng.integers(len(others)))]
