"""What is measured of the ProMPs: each case timed in turn for all, and their results compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.benchmarks import promp_reference as reference
from hri_prediction.benchmarks.promp_plain import PlainBank, PlainProMP, plain_learn
from hri_prediction.benchmarks.reaches import (
    REST_S,
    SHOULDER,
    TARGETS,
    draw_demonstrations,
    draw_reach,
)
from hri_prediction.benchmarks.timing import Contender, time_in_turn
from hri_prediction.prediction.bank import HypothesisBank, bank_prior
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary, train_library
from hri_prediction.prediction.output import ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.filtering import WeightFilter
from hri_prediction.promp.learning import LearningConfig, learn
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import fit_weights
from hri_prediction.tracks.track import ArmSample

Array = NDArray[np.float64]
Progress = Callable[[], object]
OURS, PLAIN, REFERENCE = "ours", "numpy", reference.NAME
NAMES = (OURS, PLAIN, REFERENCE)
DIMS, STEP_WEIGHTS, FIT_WEIGHTS = 3, 40, 8
DEMONSTRATIONS, POINTS = 40, 200
RATE_HZ = 250.0


@dataclass(frozen=True)
class Case:
    """Outcome of one case.

    Args:
        times: Seconds of each step, by name; without those that cannot.
        differences: Largest differences between results, by what was compared.
    """

    times: dict[str, Array]
    differences: dict[str, float]


@dataclass(frozen=True)
class Extent:
    """How long to measure: rounds of each case.

    Args:
        fit: Fits.
        stream: Passes over 200 observations, and evaluations of the mean by the hundred.
        reaches: Reaches that the bank and the predictor follow.
        plain_fits: Fits in plain NumPy.
        slow: Rounds that the slowest contenders take part in.
    """

    fit: int = 60
    stream: int = 10
    reaches: int = 8
    plain_fits: int = 8
    slow: int = 3


SMOKE = Extent(fit=2, stream=1, reaches=1, plain_fits=1, slow=1)


def difference(one: object, other: object) -> float:
    """Largest absolute difference of two arrays."""
    return float(np.max(np.abs(np.asarray(one) - np.asarray(other))))


def fit_case(
    rng: np.random.Generator, weights: int, extent: Extent, with_reference: bool, tick: Progress
) -> Case:
    """Learn from 40 demonstrations of 200 samples in three dimensions."""
    demos = draw_demonstrations(rng, DEMONSTRATIONS, POINTS, DIMS)
    config = LearningConfig(weights_per_dim=weights)
    learnt: dict[str, ProMP | PlainProMP] = {}

    def ours(_: int) -> None:
        learnt[OURS] = learn(demos, config)

    def plain(_: int) -> None:
        learnt[PLAIN] = plain_learn(demos, config)

    contenders = {OURS: Contender(ours), PLAIN: Contender(plain, rounds=extent.plain_fits)}
    if with_reference:
        contenders[REFERENCE] = Contender(
            lambda _: reference.reference_learn(demos, config), rounds=extent.slow
        )
    times = time_in_turn(contenders, extent.fit, progress=tick)
    model, other = learnt[OURS], learnt[PLAIN]
    found = {
        "fit, mean": difference(model.mean, other.mean),
        "fit, covariance": difference(model.covariance, other.covariance),
        "fit, noise": difference(model.noise, other.noise),
    }
    if with_reference:
        ridge = 1e-12  # its default
        theirs = reference.reference_promp(model.mean, model.covariance, weights)
        phases, values = demos[0].phases, demos[0].values
        found["regression of one demonstration"] = difference(
            fit_weights(PhaseBasis(weights), phases, values, ridge),
            theirs.weights(phases.copy(), values, ridge),
        )
    return Case(times, found)


def step_model(rng: np.random.Generator) -> ProMP:
    """A model of 40 weights in each of three dimensions."""
    demos = draw_demonstrations(rng, DEMONSTRATIONS, POINTS, DIMS)
    return learn(demos, LearningConfig(weights_per_dim=STEP_WEIGHTS))


def condition_case(
    rng: np.random.Generator, extent: Extent, with_reference: bool, tick: Progress
) -> Case:
    """Condition on one sample after the other, 200 of a movement."""
    model = step_model(rng)
    phases = np.linspace(0.0, 1.0, POINTS)
    values = model.sample(phases, rng)[0] + 0.002 * rng.standard_normal((POINTS, DIMS))
    running: dict[str, WeightFilter | PlainProMP | reference.ReferenceFilter] = {}

    def ours() -> None:
        running[OURS] = WeightFilter(model)

    def plain() -> None:
        running[PLAIN] = plain_copy(model)

    def theirs() -> None:
        running[REFERENCE] = reference.ReferenceFilter(model)

    makers = {OURS: ours, PLAIN: plain} | ({REFERENCE: theirs} if with_reference else {})

    def contender(name: str) -> Contender:
        return Contender(lambda i: running[name].observe(phases[i], values[i]), makers[name])

    times = time_in_turn(
        {name: contender(name) for name in makers}, extent.stream, POINTS, progress=tick
    )
    batch = model.condition(phases, values)
    found = {}
    for name, state in running.items():
        if isinstance(state, WeightFilter):
            final = state.posterior()
            mean, covariance = final.mean, final.covariance
        elif isinstance(state, PlainProMP):
            mean, covariance = state.mean, state.covariance
        else:
            mean, covariance = state.model.weight_mean, state.model.weight_cov
        found[f"conditioning, mean: batch and {name}"] = difference(mean, batch.mean)
        found[f"conditioning, covariance: batch and {name}"] = difference(
            covariance, batch.covariance
        )
    return Case(times, found)


def plain_copy(model: ProMP) -> PlainProMP:
    """The same model in plain NumPy."""
    basis = model.basis
    return PlainProMP(model.mean, model.covariance, model.noise, basis.count, basis.overlap)


def mean_case(
    rng: np.random.Generator, extent: Extent, with_reference: bool, tick: Progress
) -> Case:
    """The mean path at 200 phases."""
    model, phases = step_model(rng), np.linspace(0.0, 1.0, POINTS)
    plain = plain_copy(model)
    contenders = {
        OURS: Contender(lambda _: model.trajectory_mean(phases)),
        PLAIN: Contender(lambda _: plain.trajectory_mean(phases)),
    }
    mean = model.trajectory_mean(phases)
    found = {"mean path, numpy": difference(mean, plain.trajectory_mean(phases))}
    if with_reference:
        theirs = reference.reference_promp(model.mean, model.covariance, STEP_WEIGHTS)
        contenders[REFERENCE] = Contender(lambda _: theirs.mean_trajectory(phases.copy()))
        found["mean path"] = difference(mean, theirs.mean_trajectory(phases.copy()))
        spread = np.diagonal(model.trajectory_covariance(phases), axis1=1, axis2=2)
        found["variance along the path"] = difference(spread, theirs.var_trajectory(phases.copy()))
    return Case(time_in_turn(contenders, extent.stream, 100, progress=tick), found)


def draw_library(rng: np.random.Generator, reaches: int = 8) -> TaskLibrary:
    """Four tasks, learnt from drawn reaches."""
    tracks = [draw_reach(rng, task, i, RATE_HZ) for task in TARGETS for i in range(reaches)]
    return train_library(tracks, PredictorConfig())


def bank_case(
    rng: np.random.Generator,
    library: TaskLibrary,
    extent: Extent,
    with_reference: bool,
    tick: Progress,
) -> Case:
    """One sample into the bank of hypotheses, the prediction of the next 1.5 s out."""
    config = PredictorConfig()
    prior = bank_prior(library.for_side("right"), config)
    points = 1 + round(config.horizon / config.step)
    reach = draw_reach(rng, next(iter(TARGETS)), 0, 1.0 / config.update_interval)
    begun = reach.time_s >= REST_S
    times = reach.time_s[begun] - REST_S
    values = (reach.keypoints[begun, 1:3] - SHOULDER).reshape(-1, 6)
    seen = np.ones(6, dtype=bool)
    bank, plain = HypothesisBank(prior, config), PlainBank(prior, config)

    def ours(i: int) -> tuple[Array, Array]:
        bank.observe(times[i], values[i], seen)
        return bank.moments(times[i], config.step, points)

    def follow(other: PlainBank) -> Callable[[int], tuple[Array, Array]]:
        def step(i: int) -> tuple[Array, Array]:
            other.observe(times[i], values[i])
            return other.moments(times[i], config.step, points)

        return step

    others = {PLAIN: plain}
    if with_reference:
        others[REFERENCE] = reference.ReferenceBank(prior, config)
    contenders = {OURS: Contender(ours, bank.restart)}
    for name, other in others.items():
        most = extent.slow if name == REFERENCE else extent.reaches
        contenders[name] = Contender(follow(other), other.restart, most)
    taken = time_in_turn(contenders, extent.reaches, times.size, progress=tick)
    found: dict[str, float] = {}
    mean, covariance = bank.moments(times[-1], config.step, points)
    for name, other in others.items():
        their_mean, their_covariance = other.moments(times[-1], config.step, points)
        found |= {
            f"bank, means of weights: {name}": difference(bank.means, other.means),
            f"bank, their covariances: {name}": difference(bank.covariances, other.covariances),
            f"bank, prediction's mean: {name}": difference(mean, their_mean),
            f"bank, its covariance: {name}": difference(covariance, their_covariance),
        }
    return Case(taken, found)


def predictor_case(
    rng: np.random.Generator, library: TaskLibrary, extent: Extent, tick: Progress
) -> Case:
    """One sample of motion capture into the whole predictor, the arm's prediction out.

    Each sample at 250 Hz updates the bank; counted is what happens during the reach.
    """
    predictor = ReachPredictor(library, replace(PredictorConfig(), update_interval=0.001))
    reach = draw_reach(rng, next(iter(TARGETS)), 0, RATE_HZ)
    valid = np.ones(4, dtype=bool)
    samples = [
        ArmSample(round(t * 1e9), points, valid, "right")
        for t, points in zip(reach.time_s, reach.keypoints, strict=True)
    ]
    reaching = np.zeros(len(samples), dtype=bool)

    def step(i: int) -> None:
        predictor.observe(samples[i])
        prediction = predictor.predict()
        reaching[i] = prediction is not None and prediction.state == ReachState.REACHING

    contender = Contender(step, predictor.reset)
    taken = time_in_turn({OURS: contender}, extent.reaches, len(samples), progress=tick)[OURS]
    return Case({OURS: taken.reshape(extent.reaches, -1)[:, reaching].ravel()}, {})
