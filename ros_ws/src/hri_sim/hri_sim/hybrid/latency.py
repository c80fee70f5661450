"""Whether predictions wait for what is learnt beside them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.hybrid.background import Background
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.loop import Expected, Explained, Learnt, Reached, Rested, Setup
from hri_prediction.hybrid.merging import merged
from hri_prediction.hybrid.person import Rest
from hri_prediction.hybrid.watch import ArmWatch
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import train_library
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample, ArmTrack
from hri_prediction.warm import warm_kernels
from hri_sim.people.population import TARGETS, draw_person, record_reach
from hri_sim.people.seeding import population_generator

Array = NDArray[np.float64]

_PERIOD_NS = 4_000_000


@dataclass(frozen=True, eq=False)
class Timed:
    """What was measured of predictions one after the other.

    Attributes:
        spent_ms: From a sample to the prediction from it (n,).
        worked: Whether the process that learns beside was at work meanwhile (n,).
        learnt: Reaches that were learnt beside.
        explained: Mean paths that were explained beside.
    """

    spent_ms: Array
    worked: NDArray[np.bool_]
    learnt: int = 0
    explained: int = 0


@dataclass(frozen=True)
class Latency:
    """Time from a sample to the prediction from it [ms].

    Attributes:
        p50, p99, most: Of all; NaN without any.
        count: How many.
        learnt: Reaches that were learnt beside.
        explained: Mean paths that were explained beside.
    """

    p50: float
    p99: float
    most: float
    count: int
    learnt: int
    explained: int


def latency(timed: Sequence[Timed], *, at_work: bool = False) -> Latency:
    """Of several runs together.

    Args:
        timed: What was measured.
        at_work: Whether only of predictions that were made while the process that learns was at work.
    """
    values = np.concatenate(
        [each.spent_ms[each.worked] if at_work else each.spent_ms for each in timed]
    )
    learnt, explained = sum(each.learnt for each in timed), sum(each.explained for each in timed)
    if not len(values):
        return Latency(math.nan, math.nan, math.nan, 0, learnt, explained)
    p50, p99 = np.percentile(values, (50.0, 99.0))
    return Latency(float(p50), float(p99), float(values.max()), len(values), learnt, explained)


def _ran_ns(pid: int) -> int:
    """For how long all threads of a process have had a processor [ns]; 0 when it has ended."""
    try:
        # Its clock, as clock_getcpuclockid(3) has it: exact, where /proc is brought up to date at ticks.
        return time.clock_gettime_ns((~pid << 3) | 2)
    except OSError:
        return 0


def stream(reaches: int, seed: int) -> list[ArmSample]:
    """Samples of one person who reaches again and again for the four targets of the population."""
    person = draw_person("matched", "latency", seed)
    rng = population_generator(seed, "latency", 1)
    samples: list[ArmSample] = []
    stamp = 0
    names = list(TARGETS)
    for number in range(reaches):
        recorded = record_reach(person, "matched", names[number % len(names)], number, rng)
        for sample in recorded.track.samples(stamp):
            samples.append(sample)
        stamp = samples[-1].stamp_ns + _PERIOD_NS
    return samples


def _lessons() -> list[ArmTrack]:
    """Reaches of somebody else, so that there are as many tasks with and without the hybrid."""
    person = draw_person("matched", "other", 0)
    rng = population_generator(0, "other", 1)
    return [
        record_reach(person, "matched", name, trial, rng).track
        for name in TARGETS
        for trial in range(3)
    ]


def measure(
    samples: list[ArmSample],
    hybrid: bool,
    *,
    pace: bool = True,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> Timed:
    """Predict each sample as the node does, at the pace of the samples.

    Args:
        samples: Of one arm.
        hybrid: Whether a process learns beside, and hands libraries over.
        pace: Whether to wait for each sample's time.
        progress: Called with samples done, and their number.
    """
    warm_kernels()
    predictor, config = PredictorConfig(), HybridConfig()
    targets = {name: np.array(at) for name, at in TARGETS.items()}
    watch = ArmWatch("right", targets, predictor, config)
    core = ReachPredictor(train_library(_lessons(), predictor), predictor)
    loop = Background(Setup(targets, predictor, config)) if hybrid else None
    spent: list[float] = []
    worked: list[bool] = []
    learnt = explained = ran_ns = 0
    begun = time.perf_counter()
    try:
        for number, sample in enumerate(samples):
            due = begun + 1e-9 * (sample.stamp_ns - samples[0].stamp_ns)
            while pace and (left := due - time.perf_counter()) > 0.0:
                time.sleep(left)
            core.observe(sample)
            if loop is not None:
                watch.observe(sample, core)
            core.predict(sample.stamp_ns)
            # From when the sample came: what is done after predictions delays the next one.
            spent.append(1e3 * (time.perf_counter() - due))
            before_ns, ran_ns = ran_ns, 0 if loop is None else _ran_ns(loop.pid)
            worked.append(ran_ns > before_ns > 0)
            if loop is not None:
                for told in watch.questions():
                    loop.ask(Rested("p", told) if isinstance(told, Rest) else Reached("p", told))
                for answer in loop.answers():
                    learnt += isinstance(answer, Learnt)
                    explained += isinstance(answer, Explained)
                    if isinstance(answer, Expected):
                        core.expect(merged(None, answer.library))
            if number % 250 == 0:
                progress(number, len(samples))
    finally:
        if loop is not None:
            loop.close()
    return Timed(np.array(spent), np.array(worked), learnt, explained)
