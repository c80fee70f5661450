"""The hybrid loop of one person: first guess, learning while predicting, asking why (thesis figure 3.3)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.hybrid.body import BodyArm
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.prior_path import Geometry, PriorPath, optimal_path, share_of
from hri_prediction.hybrid.task import PersonalTask, TaskKey, TaskRules
from hri_prediction.hybrid.weight_process import PersonalProcess, WeightData, WeightProcess
from hri_prediction.hybrid.why import Why, why
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS, TaskLibrary

Array = NDArray[np.float64]

ELSEWHERE = "rest"
"""Where a hand is that rests at none of the targets."""
_OWN_LOG_SD = 0.2
"""Spread of the logarithm of a person's durations between tasks."""


class NoTarget(DataError):
    """A reach that ended at none of the targets: nothing to learn, and nothing wrong."""


@dataclass(frozen=True, eq=False)
class Rest:
    """An arm that rests before a reach.

    Attributes:
        body: The arm, and where it faces.
        points: Shoulder, elbow, wrist, tip (4, 3) [m], in the world.
    """

    body: BodyArm
    points: Array

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=float)
        if points.shape != (4, 3) or not np.isfinite(points).all():
            raise DataError("a resting arm of which not all is known", expected="(4, 3), finite")
        points.setflags(write=False)
        object.__setattr__(self, "points", points)


@dataclass(frozen=True, eq=False)
class SeenReach:
    """A reach that has ended.

    Attributes:
        body: The arm, and where it faces.
        phases: Of the samples (P,), from 0 to 1.
        values: Elbow and wrist (P, 6) [m], from the shoulder at the onset, along the axes of the world.
        shoulder: At the onset, in the world (3,) [m].
        start_tip: Tip of the hand at the onset, in the world (3,) [m].
        end_tip: At the end (3,) [m].
        duration_s: Between the crossings of the onset speed.
    """

    body: BodyArm
    phases: Array
    values: Array
    shoulder: Array
    start_tip: Array
    end_tip: Array
    duration_s: float


class HybridPerson:
    """What is known of one person, and what follows from it.

    Args:
        targets: Where the tip of the hand may end, by name (3,) [m], in the world.
        people: What weights of all people are like.
        predictor: Settings of the predictor that is given libraries.
        config: Settings of the hybrid.
        tasks: Known of this person from before.
        own: Weights known of this person from before.

    Attributes:
        tasks: By key.
        weights: Of costs, as they are expected of this person.
        remarks: On targets from the last rest: why one cannot be reached, or has no optimum.
        guessed_sd: Of tasks of which nothing was seen: standard deviation of the logarithms of their
            weights, mean over costs.

    Raises:
        DataError: without targets, or with tasks or weights that were learnt with other settings.
    """

    def __init__(
        self,
        targets: Mapping[str, Array],
        people: WeightProcess,
        predictor: PredictorConfig | None = None,
        config: HybridConfig | None = None,
        *,
        tasks: Iterable[PersonalTask] = (),
        own: WeightData | None = None,
    ) -> None:
        if not targets:
            raise DataError("no targets", expected="one or more that the person may reach for")
        for name in targets:
            if name == ELSEWHERE or "_from_" in name:
                raise DataError(
                    f"target {name!r}", expected=f"a name other than {ELSEWHERE}, without _from_"
                )
        self.targets = {name: np.array(at, dtype=float) for name, at in targets.items()}
        self.rules = TaskRules(
            predictor or PredictorConfig(), config or HybridConfig(), people.names
        )
        self.config = self.rules.config
        self.weights = PersonalProcess(people, own or WeightData.none(people.names))
        self.tasks = {task.key: task for task in tasks}
        for task in self.tasks.values():
            self._check(task)
        self._bodies: dict[str, BodyArm] = {}
        self.remarks: dict[str, str] = {}
        self.guessed_sd: dict[TaskKey, float] = {}

    def _check(self, task: PersonalTask) -> None:
        """Whether a task means here what it meant when it was learnt."""
        sizes = len(task.expected), len(task.alpha)
        wanted = DIMS * self.rules.basis.count, len(self.rules.settings.costs)
        if sizes != wanted:
            others = (
                f"{sizes[0]} weights of paths and {sizes[1]} costs "
                f"instead of {wanted[0]} and {wanted[1]}"
            )
        else:
            others = task.settings.differences(self.rules.settings) if task.settings else ""
        if others:
            raise DataError(
                f"{task.key.name} was learnt with {others}",
                expected="what this predictor has",
                hint="use the settings of then, or forget the person",
            )

    # ------------------------------------------------------------------ first guess
    def at_rest(self, rest: Rest) -> TaskLibrary:
        """What the person may do next from here: each target that can be reached is a task.

        Raises:
            DataError: none can be reached.
        """
        side = rest.body.side
        self._bodies[side] = rest.body
        shoulder, tip = rest.points[0], rest.points[3]
        start = (rest.points[1:3] - shoulder).ravel()
        here = self.place_of(tip)
        self.remarks = {}
        keys = []
        for target, at in self.targets.items():
            if target == here:
                continue
            key = TaskKey(side, here, target)
            try:
                self._prepare(key, rest.body, Geometry(start, at - shoulder))
            except DataError as error:
                self.remarks[target] = str(error)
                continue
            if why_not := self.tasks[key].path.why_not:
                self.remarks[target] = f"expected along a straight line: {why_not}"
            keys.append(key)
        if not keys:
            reason = next(iter(self.remarks.values()), "the hand is where it may reach to")
            raise DataError(f"no target can be reached for: {reason}", expected="one at least")
        return self.library(keys, rest.body)

    def library(self, keys: Iterable[TaskKey], body: BodyArm) -> TaskLibrary:
        """Tasks as a predictor takes them."""
        return TaskLibrary(
            tuple(self.rules.model(self.tasks[key], *self.usual_duration(key)) for key in keys),
            body.arm.upper_m,
            body.arm.forearm_m,
        )

    def usual_duration(self, but: TaskKey | None = None) -> tuple[float, float]:
        """Logarithm of this person's durations from rest to rest [s], and its standard deviation.

        Args:
            but: A task that does not count: that which it is expected of.
        """
        log_s, log_sd = math.log(self.config.duration), self.config.duration_log_sd
        logs = [
            np.log(task.durations_s / task.path.share)
            for key, task in self.tasks.items()
            if task.seen and key != but
        ]
        if not logs:
            return log_s, log_sd
        own = np.array([each.mean() for each in logs])
        # Tasks of one person are alike, but not the same.
        share = log_sd**2 / (log_sd**2 + _OWN_LOG_SD**2 / len(own))
        variance = _OWN_LOG_SD**2 + share * _OWN_LOG_SD**2 / len(own)
        return log_s + share * (float(own.mean()) - log_s), math.sqrt(variance)

    def place_of(self, tip: Array) -> str:
        """The target that the tip of a hand is at, or `ELSEWHERE`."""
        apart = {name: float(np.linalg.norm(tip - at)) for name, at in self.targets.items()}
        nearest = min(apart, key=lambda name: apart[name])
        return nearest if apart[nearest] <= self.config.place_radius else ELSEWHERE

    def _prepare(self, key: TaskKey, body: BodyArm, geometry: Geometry) -> None:
        """Have a task as it is from here."""
        known = self.tasks.get(key)
        if known is not None and known.seen:
            if known.geometry.apart_m(geometry) > self.config.moved:
                path = self._path(body, geometry, known.alpha)
                self.tasks[key] = self.rules.moved(known, geometry, path)
            return
        # Nothing was seen yet: the newest weights, from where the arm is now.
        straight = body.posture(geometry.start)
        guess = self.weights.guess(straight, body.posture_at(geometry.tip, straight))
        path = self._path(body, geometry, guess.alpha)
        self.guessed_sd[key] = float(guess.logs_sd.mean())
        self.tasks[key] = self.rules.begin(key, guess.alpha, geometry, path)

    def _path(self, body: BodyArm, geometry: Geometry, alpha: Array) -> PriorPath:
        duration_s = math.exp(self.usual_duration()[0])
        onset = self.rules.predictor.onset_speed
        return optimal_path(body, geometry, duration_s, alpha, self.weights.names, onset)

    # ------------------------------------------------------------------ learning while predicting
    def reached(self, reach: SeenReach) -> TaskKey:
        """Learn from a reach that has ended.

        Returns:
            Which task it was.

        Raises:
            DataError: it ended at no target, or too little of it was seen.
        """
        target, start = self.place_of(reach.end_tip), self.place_of(reach.start_tip)
        if target == ELSEWHERE:
            apart = min(float(np.linalg.norm(reach.end_tip - at)) for at in self.targets.values())
            raise NoTarget(
                f"a reach ended {100.0 * apart:.0f} cm from the nearest target",
                expected=f"{100.0 * self.config.place_radius:.0f} cm or less",
            )
        if target == start:
            raise DataError(f"a reach from {target} ended there", expected="another target")
        key = TaskKey(reach.body.side, start, target)
        first = reach.values[np.isfinite(reach.values).all(axis=1)][:1]
        if not len(first):
            raise DataError("a reach without elbow and wrist", expected="both to be seen")
        self._bodies[key.side] = reach.body
        geometry = Geometry(first[0], self.targets[target] - reach.shoulder)
        self._prepare(key, reach.body, geometry)
        task = self.tasks[key]
        self.tasks[key] = self.rules.updated(task, reach.phases, reach.values, reach.duration_s)
        self.guessed_sd.pop(key, None)
        return key

    # ------------------------------------------------------------------ why
    def to_explain(self) -> list[TaskKey]:
        """Tasks whose mean path has settled, and of which twice as much is known as when last explained."""
        return [
            key
            for key, task in sorted(self.tasks.items())
            if key.side in self._bodies
            and task.seen >= max(self.config.settled_reaches, 2 * task.explained)
            and task.settled <= self.config.settled
        ]

    def explain(self, key: TaskKey) -> Why:
        """Ask which weights the mean path of a task is the optimum of, and learn them.

        Raises:
            DataError: the mean path cannot be used.
            NotConverged: no optimum was found.
        """
        task = self.tasks[key]
        # Whatever comes of it: not again before there is more to go by.
        self.tasks[key] = replace(task, explained=task.seen)
        guess = self.weights.guess(task.path.q_start, task.path.q_end)
        model, body = self.rules.model(task, *self.usual_duration(key)), self._bodies[key.side]
        # The path was expected before anybody knew how long this person takes.
        share = share_of(
            body,
            task.geometry,
            model.duration_mean_s,
            task.alpha,
            self.weights.names,
            self.rules.predictor.onset_speed,
        )
        found = why(model, body, guess.alpha, self.weights.names, share)
        self.weights = self.weights.learnt(found.data.of_reach(key.file))
        return found
