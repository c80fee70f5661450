"""A closer look at single conditions than their outcomes give: when, where and with what was contact."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.robot import load_robot
from hri_planner.robot.model import CAPSULE_NAMES
from hri_prediction.arm.geometry import ArmRadii, FloatArray, arm_capsules
from hri_prediction.compiled import processor
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.benchmark.conditions import Condition, task_conditions
from hri_sim.benchmark.episode import watch_episode
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.outcome import REST_SPEED, Execution, Outcome
from hri_sim.benchmark.planners import PlannerSetup
from hri_sim.benchmark.rows import append_line
from hri_sim.benchmark.workers import do_all, versions

LIMBS = ("upper arm", "forearm", "hand")
PARTS = tuple(name.replace("_", " ") for name in CAPSULE_NAMES)
SCALE_M = 0.05
"""A clearance that falls short of the margin by this costs one, squared."""


@dataclass(frozen=True)
class Item:
    """One condition with one planner.

    Attributes:
        setup: The planner.
        split: ``tuning`` or ``test``.
        task: Number.
        condition: Number within the task.
        slowdown: F.
        seed: Of noise.
    """

    setup: PlannerSetup
    split: str
    task: int
    condition: int
    slowdown: float
    seed: int

    def find(self) -> Condition:
        """The condition."""
        return task_conditions(self.split, self.task).conditions[self.condition]

    def watch(self) -> tuple[Execution, Outcome]:
        """What happens in it."""
        library = task_library(self.split, self.task)
        return watch_episode(
            self.find(), self.setup, library, slowdown=self.slowdown, seed=self.seed
        )

    @property
    def mark(self) -> str:
        """Hash of all that what happens depends on."""
        parts = json.dumps([asdict(self), asdict(self.setup.config), _code()])
        return hashlib.sha256(parts.encode()).hexdigest()[:16]


@functools.cache
def _code() -> list[str]:
    """The code at work: a hash of ours, versions of what it computes with."""
    return [
        dependency_hash(__name__),
        processor(),
        *(f"{name} {version}" for name, version in sorted(versions().items())),
    ]


@dataclass(frozen=True)
class Look:
    """What was seen in one condition.

    Attributes:
        outcome: Its measures.
        collision_cost: Integral over the motion of the squared shortfalls of the clearances of all
            pairs of limbs from the margin, in units of 5 cm [s].
        closest_s: When robot and person were nearest, from the robot's start [s].
        contact_s: When they first touched on the way [s]; none when they did not.
        standing: Whether the robot was at rest then (or at the closest moment).
        part: Of the robot, at the first contact (or the closest moment).
        limb: Of the person.
    """

    outcome: Outcome
    collision_cost: float
    closest_s: float
    contact_s: float | None
    standing: bool
    part: str
    limb: str


def pair_distances(run: Execution) -> FloatArray:
    """Distances of the robot's three parts and the person's three limbs over time (N, 3, 3) [m]."""
    robot = load_robot()
    parts, limbs = robot.robot_capsules(run.q), arm_capsules(run.arm)
    radii, theirs = robot.capsule_radii, ArmRadii().array
    return np.array(
        [capsule_distances(a, radii, b, theirs) for a, b in zip(parts, limbs, strict=True)]
    )


def collision_cost(distances: FloatArray, margin: float, step_s: float) -> float:
    """See :class:`Look`, from distances (N, ...) [m]."""
    short = np.maximum(margin - distances, 0.0) / SCALE_M
    return float((short**2).sum() * step_s)


def look(item: Item) -> Look:
    """Watch a condition closely."""
    run, outcome = item.watch()
    end = len(run.q) if run.arrived is None else run.arrived + 1
    pairs = pair_distances(run)[:end]
    nearest = pairs.min(axis=(1, 2))
    closest = int(nearest.argmin())
    touching = np.flatnonzero(nearest <= 0.0)
    row = int(touching[0]) if len(touching) else closest
    part, limb = np.unravel_index(int(pairs[row].argmin()), pairs.shape[1:])
    return Look(
        outcome=outcome,
        collision_cost=collision_cost(pairs, item.setup.config.margin, run.step_s),
        closest_s=closest * run.step_s,
        contact_s=row * run.step_s if len(touching) else None,
        standing=bool(np.abs(run.qd[row]).max() < REST_SPEED),
        part=PARTS[part],
        limb=LIMBS[limb],
    )


class KeptLooks:
    """Looks in a file of lines: what is in it need not be done again.

    Args:
        path: The file; it need not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def read(self) -> dict[str, Look]:
        """Looks by the marks of their items; a line that was cut off is none."""
        found: dict[str, Look] = {}
        for line in self._path.read_text().splitlines() if self._path.exists() else ():
            try:
                row = json.loads(line)
                found[row["mark"]] = _look_from(row["look"])
            except (ValueError, KeyError, TypeError):
                continue
        return found

    def add(self, item: Item, seen: Look) -> None:
        """Append a look."""
        row = {"mark": item.mark, "look": dataclasses.asdict(seen)}
        append_line(self._path, json.dumps(row, allow_nan=False))


def _look_from(values: dict[str, Any]) -> Look:
    return Look(**{**values, "outcome": Outcome(**values["outcome"])})


def _work(item: Item) -> tuple[Item, Look]:
    return item, look(item)


def look_at_all(
    items: Sequence[Item],
    path: Path,
    *,
    workers: int,
    scheduler: str | None,
    progress: Callable[[int, int], None],
) -> list[Look]:
    """Look at what is not yet in a file; all looks in the order of the items."""
    kept = KeptLooks(path)
    before = kept.read()
    done = {item: before[item.mark] for item in items if item.mark in before}
    waiting = [item for item in items if item not in done]
    progress(len(done), len(items))
    if waiting:
        for item, seen in do_all(_work, waiting, workers=workers, scheduler=scheduler):
            kept.add(item, seen)
            done[item] = seen
            progress(len(done), len(items))
    return [done[item] for item in items]
