"""One reach that a person makes again and again: a first guess, and what was seen since."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError, shown
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.personal import Personal, PersonalPrior, learn_personal, personal_prior
from hri_prediction.hybrid.prior_path import Geometry, PriorPath
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS, TaskModel
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import fit_weights

Array = NDArray[np.float64]

_RIDGE = 1e-6
_PACE_LOG_SD, _PACE_STRENGTH = 0.12, 4.0
"""Spread of the logarithm of one person's durations, and reaches that it counts for."""
_RESIDUAL_M = 0.002
"""How far paths usually are from the basis, root mean square."""


@dataclass(frozen=True, order=True)
class TaskKey:
    """Which reach it is.

    Attributes:
        side: Of the arm.
        start: Name of the place where the hand rests before.
        target: Name of the target.
    """

    side: str
    start: str
    target: str

    @property
    def name(self) -> str:
        """As tasks are called in predictions."""
        return f"{self.target}_from_{self.start}"

    @property
    def file(self) -> str:
        """As its file is called."""
        return f"{self.side}_{self.name}.npz"


@dataclass(frozen=True)
class TaskSettings:
    """What the numbers of a task mean nothing without.

    Attributes:
        costs: Whose weights alpha are.
        count: Functions of the basis for each coordinate.
        overlap: Of these.
        onset_speed: Where reaches are cut [m/s].
    """

    costs: tuple[str, ...]
    count: int
    overlap: float
    onset_speed: float

    def differences(self, other: TaskSettings) -> str:
        """What is not the same in others, in words: name, value here, value there."""
        pairs = ((f.name, getattr(self, f.name), getattr(other, f.name)) for f in fields(self))
        return ", ".join(
            f"{name} {shown(own)} instead of {shown(theirs)}"
            for name, own, theirs in pairs
            if own != theirs
        )


@dataclass(frozen=True, eq=False)
class PersonalTask:
    """A reach of one person.

    Attributes:
        key: Which.
        alpha: Weights of costs that its expected path is the optimum of (n,). They stay as long as there
            are deviations from it.
        geometry: What it is between, as the person sits now.
        path: Expected between these.
        expected: The same as weights of the basis (6 W,).
        deviations: Of the reaches seen from what was expected of each, likewise (N, 6 W).
        durations_s: Of these, from where they pass the onset speed to where they do so again (N,).
        divergences: Kullback-Leibler divergence of each update from what was known before, by weight.
        seen: How many reaches were ever seen; the oldest are no longer kept.
        explained: How many of them there were when the mean path was last explained.
        settings: What it was learnt with; none: nobody knows.
    """

    key: TaskKey
    alpha: Array
    geometry: Geometry
    path: PriorPath
    expected: Array
    deviations: Array
    durations_s: Array
    divergences: tuple[float, ...] = ()
    seen: int = 0
    explained: int = 0
    settings: TaskSettings | None = None

    def __post_init__(self) -> None:
        count, size = len(self.durations_s), len(self.expected)
        shapes = {"deviations": (count, size), "durations_s": (count,), "expected": (size,)}
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise DataError(
                    f"{name} of {self.key.name} of shape {array.shape}",
                    expected=f"finite numbers of shape {shape}",
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.seen < count or not np.isfinite(self.divergences).all():
            raise DataError(
                f"{self.key.name}: {self.seen} reaches seen, {count} kept, divergences "
                f"{list(self.divergences)[:5]}",
                expected="as many seen as kept, and finite divergences",
            )
        if (self.durations_s <= 0.0).any():
            raise DataError(f"{self.key.name} has a duration that is not positive")

    @property
    def settled(self) -> float:
        """The divergence of the newest update; infinite before any."""
        return self.divergences[-1] if self.divergences else math.inf


class TaskRules:
    """How tasks become models: what all tasks of a predictor have in common.

    Args:
        predictor: Its settings.
        config: Of the hybrid.
        costs: Whose weights tasks have.
    """

    def __init__(
        self, predictor: PredictorConfig, config: HybridConfig, costs: tuple[str, ...]
    ) -> None:
        self.predictor, self.config = predictor, config
        self.basis = PhaseBasis(predictor.weights_per_dim, predictor.learning.overlap)
        self.settings = TaskSettings(
            costs, self.basis.count, predictor.learning.overlap, predictor.onset_speed
        )

    def weights_of(self, phases: Array, values: Array) -> Array:
        """Weights (6 W,) of a path (P, 6) at phases (P,)."""
        return fit_weights(self.basis, phases, values, _RIDGE)

    def begin(
        self, key: TaskKey, alpha: Array, geometry: Geometry, path: PriorPath
    ) -> PersonalTask:
        """A task of which nothing was seen."""
        expected = self.weights_of(path.phases, path.values)
        return PersonalTask(
            key,
            alpha,
            geometry,
            path,
            expected,
            np.zeros((0, len(expected))),
            np.zeros(0),
            settings=self.settings,
        )

    def moved(self, task: PersonalTask, geometry: Geometry, path: PriorPath) -> PersonalTask:
        """The same task from where the person rests now; deviations go along."""
        expected = self.weights_of(path.phases, path.values)
        return replace(task, geometry=geometry, path=path, expected=expected)

    def updated(
        self, task: PersonalTask, phases: Array, values: Array, duration_s: float
    ) -> PersonalTask:
        """A task with one more reach.

        Args:
            task: Before.
            phases: Of the samples (P,), 0 to 1.
            values: Elbow and wrist (P, 6) from the shoulder at the onset [m]; NaN where not seen.
            duration_s: Between the crossings of the onset speed.

        Raises:
            DataError: on a duration that is none, or an elbow or wrist that was not seen at all.
        """
        deviation = self.weights_of(phases, values) - task.expected
        most = self.config.most_reaches
        new = replace(
            task,
            deviations=np.vstack([task.deviations, deviation])[-most:],
            durations_s=np.append(task.durations_s, duration_s)[-most:],
            seen=task.seen + 1,
        )
        change = self.promp(new).kl_divergence(self.promp(task)) / len(deviation)
        return replace(new, divergences=(*task.divergences, float(change))[-most:])

    def prior(self, task: PersonalTask) -> PersonalPrior:
        """What is expected of deviations."""
        return personal_prior(self.basis, task.expected, self.config, self.predictor.smoothness)

    def personal(self, task: PersonalTask) -> Personal:
        """What is known of them."""
        return learn_personal(self.prior(task), task.deviations)

    def promp(self, task: PersonalTask) -> ProMP:
        """The distribution of the next reach."""
        known = self.personal(task)
        noise = np.eye(DIMS) * self.predictor.noise_sd**2
        return ProMP(self.basis, task.expected + known.mean, known.covariance, noise)

    def model(self, task: PersonalTask, usual_log_s: float, usual_log_sd: float) -> TaskModel:
        """A task as predictors have it.

        Args:
            task: Which.
            usual_log_s: Logarithm of durations from rest to rest [s] that are usual for this person.
            usual_log_sd: Its standard deviation.
        """
        mean, spread = duration_of(
            task.durations_s, usual_log_s + math.log(task.path.share), usual_log_sd
        )
        return TaskModel(
            name=task.key.name,
            side=task.key.side,
            promp=self.promp(task),
            duration_mean_s=math.exp(mean),
            duration_log_sd=max(spread, self.predictor.min_duration_cv),
            demonstrations=len(task.durations_s),
            residual_m=_RESIDUAL_M,
        )


def duration_of(durations_s: Array, usual_log_s: float, usual_log_sd: float) -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of the next duration.

    Args:
        durations_s: Those seen (N,) [s].
        usual_log_s: Mean of the logarithm before any is seen.
        usual_log_sd: Standard deviation of that mean.
    """
    count = len(durations_s)
    if count == 0:
        return usual_log_s, math.hypot(usual_log_sd, _PACE_LOG_SD)
    logs = np.log(durations_s)
    scatter = _PACE_STRENGTH * _PACE_LOG_SD**2 + float(np.square(logs - logs.mean()).sum())
    variance = scatter / (_PACE_STRENGTH + count)
    share = usual_log_sd**2 / (usual_log_sd**2 + variance / count)
    mean = usual_log_s + share * (float(logs.mean()) - usual_log_s)
    return mean, math.sqrt(variance + share * variance / count)
