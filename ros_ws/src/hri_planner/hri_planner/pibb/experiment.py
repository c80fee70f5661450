"""What an experiment is: where goals, obstacles and the person's targets are, and how much is tried."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from hri_planner.dmp.policy import AT_GOAL_M, DURATIONS_S, HOME, DmpPolicy
from hri_planner.pibb.costs import WEIGHTS, CostWeights
from hri_planner.pibb.initial import CLEAR_M, straight_policy
from hri_planner.pibb.names import check_name
from hri_planner.policy.config import PolicyConfig
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.model import RobotModel
from hri_prediction.config import from_mapping, parameter, validate
from hri_prediction.errors import ConfigError, DataError, PlanningError

FloatArray = NDArray[np.float64]

RESPONSES = ("press", "hand")
TABLE = ((0.85, 0.0, -0.03), (0.6, 0.7, 0.02))
"""Centre and half the size of the table, unless an experiment has another [m]."""


@dataclass(frozen=True)
class Improvement:
    """How a policy is improved.

    The last update's policy is what few roll-outs made of the one before; the mean of those of the last
    updates is what is common to them (Polyak & Juditsky 1992).

    Raises:
        ConfigError: when a value is out of range.
    """

    updates: int = parameter(15, "Updates of the policy", low=1, high=1000)
    rollouts: int = parameter(
        6, "Trials of each goal in an update, the mean among them", low=2, high=100
    )
    habituation: int = parameter(
        2, "Trials of each goal with the initial policy, before anything is learnt", low=1, high=100
    )
    exploration: float = parameter(
        0.05, "Standard deviation of a weight in the first update", unit="m", low=1e-4, high=0.5
    )
    decay: float = parameter(0.90, "What is left of it after each update", low=0.1, high=1.0)
    greed: float = parameter(8.0, "h: how much better trials count for more", low=0.0, high=100.0)
    averaged: int = parameter(
        1,
        "What has been learnt is the mean of the policies after so many last updates; 1: the last one",
        low=1,
        high=1000,
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)

    @property
    def first_averaged(self) -> int:
        """How many updates there are before those that are averaged."""
        return max(self.updates - self.averaged, 0)


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment with people; places in the base frame [m].

    Attributes:
        name: Of the experiment.
        posture: Joint angles (7,) [rad] in which the robot starts.
        goals: Where the tool goes (3,), by name.
        targets: Where a person puts the hand who means a goal (3,), by its name.
        boxes: Centre and half the size of static obstacles (k, 2, 3).
        duration: Of the robot's motion [s].
        response: ``"press"``: a person presses a key; ``"hand"``: reaches for the target.
        table: Centre and half the size of the table (2, 3), which nothing may touch.
        avoidance: Whether potential field and null space keep clear of people and obstacles; without, only
            the filter does.
        weights: Of the costs.
        improvement: How much is tried.
    """

    name: str
    posture: FloatArray
    goals: Mapping[str, FloatArray]
    targets: Mapping[str, FloatArray]
    boxes: FloatArray
    duration: float
    response: str = "hand"
    table: FloatArray = field(default_factory=lambda: np.array(TABLE))
    avoidance: bool = True
    weights: CostWeights = field(default_factory=CostWeights)
    improvement: Improvement = field(default_factory=Improvement)

    def __post_init__(self) -> None:
        """Check what can be checked without a robot.

        Raises:
            ConfigError: naming what does not fit.
        """
        check_name("experiment", self.name)
        if len(self.goals) < 2:
            raise ConfigError(
                f"goals {list(self.goals)}", expected="at least two: one alone is no riddle"
            )
        if HOME in self.goals:
            raise ConfigError(
                f"a goal is named {HOME!r}", expected="another name: that is the start's"
            )
        if not (self.solids[:, 1] > 0.0).all():
            raise ConfigError(
                "a box or the table has an edge that is not positive", expected="edges in m"
            )
        if set(self.targets) != set(self.goals):
            raise ConfigError(
                f"targets for {sorted(self.targets)}", expected=f"for {sorted(self.goals)}"
            )
        if self.response not in RESPONSES:
            raise ConfigError(f"response {self.response!r}", expected=" or ".join(RESPONSES))

    @property
    def solids(self) -> FloatArray:
        """Centre and half the size of all that stands in the scene, the table last (k, 2, 3) [m]."""
        return np.concatenate((self.boxes, self.table[None]))

    def check(self, robot: RobotModel) -> None:
        """Check that a robot can do it.

        Raises:
            ConfigError: when a goal is in an obstacle, or out of reach.
        """
        if not robot.within_limits(self.posture):
            raise ConfigError(
                f"posture {self.posture.tolist()}", expected="angles within the joint limits"
            )
        for name, place in self.goals.items():
            for other in list(self.goals)[: list(self.goals).index(name)]:
                if np.linalg.norm(place - self.goals[other]) < 2.0 * AT_GOAL_M:
                    raise ConfigError(
                        f"goals {other} and {name} are one place", expected="places apart"
                    )
        least = float(robot.capsule_radii[2]) + CLEAR_M
        places = {"the start": robot.frames(self.posture)[3], **self.goals}
        for name, place in places.items():
            for index, (centre, half) in enumerate(self.solids):
                obstacle = f"obstacle {index}" if index < len(self.boxes) else "the table"
                gap = float(np.linalg.norm(np.maximum(np.abs(place - centre) - half, 0.0)))
                if gap < least:
                    raise ConfigError(
                        f"{name} ({', '.join(f'{v:.3f}' for v in place)}) is {100 * gap:.1f} cm from "
                        f"{obstacle}",
                        expected=f"at least {100 * least:.1f} cm, the tool's radius and a margin",
                        hint=f"move the goal or {obstacle}",
                    )
            try:
                solve_ik(robot, np.array(place), self.posture, np.random.default_rng(0))
            except PlanningError as error:
                raise ConfigError(f"goal {name}: {error}") from error

    def initial_policy(self, robot: RobotModel) -> DmpPolicy:
        """Straight ways with the speed of a bell; over obstacles, raised just as far as it takes."""
        return straight_policy(robot, self.posture, self.goals, self.boxes, self.duration)

    def planner(self, config: PolicyConfig) -> PolicyConfig:
        """A planner's parameters, without field and null space where the experiment has none."""
        if self.avoidance:
            return config
        return replace(config, field_strength=0.0, link_reach=0.0)

    def with_(self, **changes: Any) -> Experiment:
        """The same with other values."""
        return replace(self, **changes)


def shipped_experiments() -> list[str]:
    """Experiments that ship with the package, by name."""
    folder = Path(str(resources.files("hri_planner.experiments")))
    return sorted(found.stem for found in folder.glob("*.yaml"))


def find_experiment(name: str) -> Path:
    """The file of an experiment: itself if it ends in ``.yaml``, else one that ships.

    Raises:
        ConfigError: when no such experiment ships, naming those that do.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    known = shipped_experiments()
    if name not in known:
        near = difflib.get_close_matches(name, known, 3) or known
        raise ConfigError(
            f"experiment {name!r}", expected=f"a .yaml file, or one like {', '.join(near)}"
        )
    return Path(str(resources.files("hri_planner.experiments"))) / f"{name}.yaml"


def load_experiment(path: str | Path) -> Experiment:
    """Read an experiment from a YAML file.

    Raises:
        ConfigError: when it cannot be read, or a value cannot be used.
    """
    try:
        content = yaml.safe_load(Path(path).read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        text = " ".join(str(error).split())
        raise ConfigError(
            f"cannot read {path}: {text}", expected="an experiment in YAML"
        ) from error
    try:
        return experiment_of(content)
    except (ConfigError, DataError) as error:
        raise ConfigError(f"{path}: {error}") from error


_KEYS = (
    "name", "posture", "goals", "targets", "boxes", "table", "duration", "response", "avoidance",
    "weights", "improvement",
)  # fmt: skip


def experiment_of(content: object) -> Experiment:
    """An experiment from a mapping, as YAML and JSON give it.

    Raises:
        ConfigError: when a key is not known or missing, or a value cannot be used.
    """
    if not isinstance(content, dict):
        raise ConfigError(f"experiment is {content!r}", expected="a mapping: " + ", ".join(_KEYS))
    unknown = [str(key) for key in content if key not in _KEYS]
    if unknown:
        near = difflib.get_close_matches(unknown[0], _KEYS, 1)
        hint = f"perhaps {near[0]}" if near else ""
        raise ConfigError(f"{', '.join(unknown)}", expected="one of " + ", ".join(_KEYS), hint=hint)
    missing = [key for key in ("name", "posture", "goals", "targets") if key not in content]
    if missing:
        raise ConfigError(
            f"no {', '.join(missing)}", expected="all of name, posture, goals, targets"
        )
    weights = content.get("weights", "balanced")
    if isinstance(weights, str):
        if weights not in WEIGHTS:
            raise ConfigError(f"weights {weights!r}", expected=", ".join(WEIGHTS))
        chosen = WEIGHTS[weights]
    else:
        chosen = from_mapping(CostWeights, _mapping("weights", weights))
    boxes, table = content.get("boxes") or [], content.get("table")
    try:
        blocks = [_block(box) for box in boxes]
    except (KeyError, TypeError) as error:
        raise ConfigError(f"boxes {boxes!r}", expected="each with center and size") from error
    try:
        top = np.array(TABLE if table is None else _block(table))
    except (KeyError, TypeError) as error:
        raise ConfigError(f"table {table!r}", expected="center and size") from error
    duration = content.get("duration", 2.5)
    low, high = DURATIONS_S
    number = isinstance(duration, int | float) and not isinstance(duration, bool)
    if not number or not low <= duration <= high:
        raise ConfigError(f"duration {duration!r}", expected=f"{low} to {high} s")
    avoidance = content.get("avoidance", True)
    if not isinstance(avoidance, bool):
        raise ConfigError(f"avoidance {avoidance!r}", expected="true or false")
    return Experiment(
        name=str(content["name"]),
        posture=_place("posture", content["posture"], 7),
        goals=_places("goals", content["goals"]),
        targets=_places("targets", content["targets"]),
        boxes=np.array(blocks).reshape(-1, 2, 3),
        duration=float(duration),
        response=str(content.get("response", "hand")),
        table=top,
        avoidance=avoidance,
        weights=chosen,
        improvement=from_mapping(
            Improvement, _mapping("improvement", content.get("improvement") or {})
        ),
    )


def to_mapping(experiment: Experiment) -> dict[str, Any]:
    """As :func:`experiment_of` takes it."""
    return {
        "name": experiment.name,
        "posture": [float(v) for v in experiment.posture],
        "duration": experiment.duration,
        "response": experiment.response,
        "avoidance": experiment.avoidance,
        "goals": {name: [float(v) for v in place] for name, place in experiment.goals.items()},
        "targets": {name: [float(v) for v in place] for name, place in experiment.targets.items()},
        "boxes": [_size_of(box) for box in experiment.boxes],
        "table": _size_of(experiment.table),
        "weights": asdict(experiment.weights),
        "improvement": asdict(experiment.improvement),
    }


def _block(content: Any) -> tuple[FloatArray, FloatArray]:
    """Centre and half the size of a box that is given by centre and size."""
    return _place("centre", content["center"]), 0.5 * _place("size", content["size"])


def _size_of(block: FloatArray) -> dict[str, list[float]]:
    """What :func:`_block` takes."""
    return {"center": [float(v) for v in block[0]], "size": [float(2.0 * v) for v in block[1]]}


def _mapping(what: str, content: object) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise ConfigError(f"{what} {content!r}", expected="values by name")
    return content


def save_experiment(path: str | Path, experiment: Experiment) -> None:
    """Write an experiment as YAML that :func:`load_experiment` reads back equal.

    Raises:
        ConfigError: when the file cannot be written.
    """
    text = yaml.safe_dump(
        to_mapping(experiment), sort_keys=False, default_flow_style=None, width=100
    )
    try:
        Path(path).write_text(text)
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror}") from error


def _places(what: str, content: object) -> dict[str, FloatArray]:
    if not isinstance(content, dict):
        raise ConfigError(f"{what} {content!r}", expected="places by name")
    return {str(name): _place(f"{what}: {name}", place) for name, place in content.items()}


def _place(what: str, content: object, count: int = 3) -> FloatArray:
    try:
        place = np.array(content, dtype=float)
    except (ArithmeticError, TypeError, ValueError) as error:
        raise ConfigError(f"{what} {content!r}", expected=f"{count} numbers") from error
    if place.shape != (count,) or not np.isfinite(place).all():
        raise ConfigError(f"{what} {content!r}", expected=f"{count} finite numbers")
    return place
