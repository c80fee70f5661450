"""What a scenario file may say.

A scenario is one table scene: where the robot starts, who sits across the table, named targets, and
a sequence of reaches in which the robot and a person move through the same space. The models are
frozen and refuse unknown fields. Everything is in metres, radians and seconds, in the world frame
(= the robot's base frame, z up, x towards the person).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from hri_prediction.errors import ConfigError, all_of, cut
from hri_prediction.files.values import read_yaml
from hri_sim.people.arm import SHOULDER_BREADTH, ArmModel

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]
Size3 = tuple[Positive, Positive, Positive]
Posture = tuple[Finite, Finite, Finite, Finite, Finite, Finite, Finite]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]


BACK = "(back)"
"""In a cue, where the hand was before its last movement; no target can be called that."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Unfitting(ValueError):
    """Parts of a scenario that do not fit each other, one text each."""

    def __init__(self, texts: list[str]) -> None:
        self.texts = texts
        super().__init__("; ".join(texts))


class TableSpec(_Model):
    """A box that nothing may touch.

    Attributes:
        center: Centre of the box [m].
        size: Full edge lengths along x, y, z [m].
    """

    center: Vector3 = (0.85, 0.0, -0.03)
    size: Size3 = (1.2, 1.4, 0.04)

    @property
    def top(self) -> float:
        """Height of the upper face [m]."""
        return self.center[2] + 0.5 * self.size[2]


class BoxSpec(_Model):
    """A box that stands in the scene, its edges along the axes; nothing may touch it.

    Attributes:
        center: Centre of the box [m].
        size: Full edge lengths along x, y, z [m].
    """

    center: Vector3
    size: Size3


class PersonSpec(_Model):
    """A seated person, facing the robot (along -x), who reaches with one arm.

    Attributes:
        id: Body id in topic names.
        side: Which arm reaches.
        shoulder: Shoulder joint [m].
        upper_arm: Shoulder to elbow [m].
        forearm: Elbow to wrist [m].
        hand: Wrist to hand tip [m].
        home: Where the hand tip rests before the first reach [m].
        noise_sd: Tracking noise of every coordinate, standard deviation [m].
        latency: Capture to delivery of a sample [s].
        dropout_rate: Bursts in which the whole arm is lost, mean number a second [1/s].
        marker_dropout_rate: The same for each single keypoint [1/s].
        dropout_duration: Mean length of a burst (exponentially distributed) [s].
        variability: Factor on all motor variability; 0 makes every reach the nominal one.
        speed_factor: Above 1 the person moves faster than the durations of the reaches say.
        swivel: Usual swivel of the elbow outwards from straight down [rad].
        lift: Usual rise of the path above the straight line, as a share of its length.
        both_arms: Whether the other arm is there too. It rests, mirrored about the middle of the body,
            never reaches, and is tracked like the first.
    """

    id: Name = "person1"
    side: Literal["right", "left"] = "right"
    shoulder: Vector3 = (0.75, 0.0, 0.40)
    upper_arm: Positive = 0.29
    forearm: Positive = 0.26
    hand: Positive = 0.09
    home: Vector3 = (0.50, 0.15, 0.10)
    noise_sd: NonNegative = 0.002
    latency: NonNegative = 0.008
    dropout_rate: NonNegative = 0.02
    marker_dropout_rate: NonNegative = 0.05
    dropout_duration: Positive = 0.02
    variability: NonNegative = 1.0
    speed_factor: Positive = 1.0
    swivel: Finite = 0.25
    lift: NonNegative = 0.15
    both_arms: bool = False

    @property
    def arm(self) -> ArmModel:
        """The arm that reaches."""
        return ArmModel(self.side, self.shoulder, self.upper_arm, self.forearm, self.hand)

    @property
    def other(self) -> PersonSpec | None:
        """The other arm, as that of a person who has no more; none: it is not there."""
        if not self.both_arms:
            return None
        inwards = -SHOULDER_BREADTH if self.side == "right" else SHOULDER_BREADTH
        twice_middle = 2.0 * self.shoulder[1] + inwards

        def mirrored(point: Vector3) -> Vector3:
            return point[0], twice_middle - point[1], point[2]

        return self.model_copy(
            update={
                "side": "left" if self.side == "right" else "right",
                "shoulder": mirrored(self.shoulder),
                "home": mirrored(self.home),
                "both_arms": False,
            }
        )

    @property
    def arms(self) -> dict[str, PersonSpec]:
        """Each arm, as that of a person who has no more, by its name in a scene.

        The arm that reaches has the body's id for a name, the other one's ends in its side.
        """
        other = self.other
        return (
            {self.id: self} if other is None else {self.id: self, f"{self.id}/{other.side}": other}
        )

    def reaches_with(self, side: str) -> bool:
        """Whether that is the arm that reaches; of a person of one arm any is."""
        return not self.both_arms or side == self.side

    @model_validator(mode="after")
    def _home_within_reach(self) -> PersonSpec:
        if not self.arm.can_reach(self.home):
            raise ValueError(f"home {self.home} is out of reach of the arm at {self.shoulder}")
        return self


class ReachSpec(_Model):
    """One reach of the robot, and what the person does meanwhile.

    Attributes:
        robot_target: Name of the target of the robot's tool.
        person_target: Name of the target of the person's hand tip; none: the person stays.
        person: Id of the person who reaches; none: the first one.
        person_delay: Start of the person's reach after the start of the robot's [s].
        person_duration: Nominal duration of the person's reach [s].
        person_candidates: Targets among which an observer cannot choose beforehand (ambiguous
            intent); empty: the person is known to reach for ``person_target``.
        duration: Duration of the robot's nominal motion [s].
        start: The reach begins no earlier than this after the begin of the first one [s].
    """

    robot_target: Name
    person_target: Name | None = None
    person: Name | None = None
    person_delay: NonNegative = 0.0
    person_duration: Positive = 1.3
    person_candidates: tuple[Name, ...] = ()
    duration: Positive = 1.5
    start: NonNegative = 0.0

    @model_validator(mode="after")
    def _candidates_hold_target(self) -> ReachSpec:
        if self.person_candidates and self.person_target not in self.person_candidates:
            raise ValueError(f"person_candidates lack the person_target {self.person_target!r}")
        return self


class Scenario(_Model):
    """A scene and a sequence of reaches.

    Attributes:
        name: Name of the scenario.
        seed: Seed of everything random in a run of it.
        robot_start: Joint angles at the start [rad].
        table: The table.
        targets: Named points [m]: tool targets of the robot, hand tip targets of persons.
        persons: Who is there.
        reaches: What is done, one after the other.
        obstacles: What else stands there; policies keep clear of it, planners know only the table.
    """

    name: str
    seed: Annotated[int, Field(ge=0)] = 0
    robot_start: Posture
    table: TableSpec = TableSpec()
    targets: dict[Name, Vector3]
    persons: tuple[PersonSpec, ...] = ()
    reaches: Annotated[tuple[ReachSpec, ...], Field(min_length=1)]
    obstacles: tuple[BoxSpec, ...] = ()

    @model_validator(mode="after")
    def _references_exist(self) -> Scenario:
        faults: list[str] = []
        ids = [person.id for person in self.persons]
        if len(set(ids)) != len(ids):
            faults.append(f"two persons share an id: {cut(', '.join(ids))}")
        known, people = cut(", ".join(self.targets)) or "none", cut(", ".join(ids))
        for index, reach in enumerate(self.reaches):
            where = f"reaches.{index}"
            if reach.robot_target not in self.targets:
                faults.append(f"{where}.robot_target {reach.robot_target!r} is not in: {known}")
            if reach.person_target is None:
                continue
            if not self.persons:
                faults.append(f"{where} has a person_target, but there are no persons")
                continue
            if reach.person is not None and reach.person not in ids:
                faults.append(f"{where}.person {reach.person!r} is not in: {people}")
                continue
            person = self.person_of(index)
            for name in dict.fromkeys([reach.person_target, *reach.person_candidates]):
                if name not in self.targets:
                    faults.append(f"{where}: the person's target {name!r} is not in: {known}")
                elif not person.arm.can_reach(self.targets[name]):
                    faults.append(f"{where}: target {name!r} is out of reach of {person.id}")
        if faults:
            raise _Unfitting(faults)
        return self

    @property
    def arms(self) -> dict[str, PersonSpec]:
        """All arms of all persons by their names in the scene, see :attr:`PersonSpec.arms`."""
        return {name: spec for person in self.persons for name, spec in person.arms.items()}

    def person_of(self, index: int) -> PersonSpec:
        """The person who reaches in reach number ``index``."""
        wanted = self.reaches[index].person or self.persons[0].id
        return next(person for person in self.persons if person.id == wanted)

    def person_from(self, index: int) -> Vector3:
        """Where the hand of the person of reach ``index`` nominally is before it [m]."""
        person = self.person_of(index)
        for earlier in range(index - 1, -1, -1):
            target = self.reaches[earlier].person_target
            if target is not None and self.person_of(earlier).id == person.id:
                return self.targets[target]
        return person.home

    def candidates(self, index: int) -> tuple[str, ...]:
        """Target names that an observer of reach ``index`` must reckon with."""
        reach = self.reaches[index]
        if reach.person_candidates:
            return reach.person_candidates
        return () if reach.person_target is None else (reach.person_target,)


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario from a YAML file.

    Raises:
        ConfigError: when the file cannot be read, is no YAML mapping, or a field is unknown,
            missing or unusable; the text names each field's path, what was got and expected.
    """
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise ConfigError(f"{path} holds {type(values).__name__}", expected="a YAML mapping")
    return scenario_from_mapping(values, where=str(path))


def scenario_from_mapping(values: dict, where: str = "scenario") -> Scenario:
    """Build a scenario from plain values.

    Args:
        values: Mapping as a YAML file gives it.
        where: What the error message calls the source.

    Raises:
        ConfigError: naming all fields that are wrong, what was got and what is expected.
    """
    try:
        return Scenario.model_validate(values)
    except ValidationError as error:
        raise _as_config_error(error, where) from error


def save_scenario(path: str | Path, scenario: Scenario) -> None:
    """Write a scenario as YAML that :func:`load_scenario` reads back equal.

    Raises:
        ConfigError: when the file cannot be written.
    """
    values = scenario.model_dump(mode="json")
    if not values["obstacles"]:
        del values["obstacles"]
    for person in values["persons"]:
        if not person["both_arms"]:
            del person["both_arms"]
    text = yaml.safe_dump(values, sort_keys=False, default_flow_style=None, width=100)
    try:
        Path(path).write_text(text)
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror}") from error


_PARTS: dict[str, type[_Model]] = {
    "table": TableSpec,
    "obstacles": BoxSpec,
    "persons": PersonSpec,
    "reaches": ReachSpec,
}
"""Fields of a scenario that have fields of their own."""


def _as_config_error(error: ValidationError, where: str) -> ConfigError:
    """All complaints of pydantic, one line each."""
    problems = error.errors()
    places = [problem["loc"] for problem in problems]
    own = [
        problem
        for problem in problems
        # Items that are wrong are not counted: a list of them alone is not too short as well.
        if problem["type"] != "too_short"
        or not any(
            place != problem["loc"] and place[: len(problem["loc"])] == problem["loc"]
            for place in places
        )
    ]
    return all_of(where, [fault for problem in own for fault in _faults(problem)])


def _faults(problem: Mapping[str, Any]) -> list[ConfigError]:
    """What one complaint is about, in our words."""
    place = problem["loc"]
    field = cut(".".join(map(str, place)))
    if problem["type"] == "value_error":
        # Our own checks say what was got and expected.
        reason = problem["ctx"]["error"]
        texts = reason.texts if isinstance(reason, _Unfitting) else [str(reason)]
        texts = [cut(text, 500) for text in texts]
        return [ConfigError(f"{field}: {text}" if field else text) for text in texts]
    if problem["type"] == "extra_forbidden":
        model = _PARTS.get(str(place[0]), Scenario) if len(place) > 1 else Scenario
        names = ", ".join(model.model_fields)
        return [ConfigError(f"unknown field {field}", expected=f"one of {names}")]
    if problem["type"] == "missing":
        return [ConfigError(f"field {field} is missing")]
    got = repr(problem["input"])
    got = got if len(got) < 80 else got[:77] + "..."
    message = problem["msg"].removeprefix("Input should be ")
    return [ConfigError(f"{field} = {got}", expected=message)]
