"""How a person reads motions: what differs from one to the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError

KINDS = ("bayesian", "heading")


@dataclass(frozen=True)
class Traits:
    """Of an observer.

    Raises:
        ConfigError: when a value is out of range.
    """

    kind: str = parameter(
        "bayesian", "How goals are inferred: by the way that is left (Dragan & Srinivasa 2013), or by "
        "where the tool is heading", choices=KINDS,
    )  # fmt: skip
    rationality: float = parameter(
        30.0, "bayesian: how straight the robot is thought to go", unit="1/m", low=0.1, high=1e3
    )
    attention: float = parameter(
        50.0,
        "heading: evidence that a metre straight at a goal gives",
        unit="1/m",
        low=0.1,
        high=1e3,
    )
    forgetting: float = parameter(
        0.6, "heading: time after which evidence counts for a third", unit="s", low=0.05, high=60.0
    )
    noise: float = parameter(
        0.015, "Standard deviation of where the tool seems to be", unit="m", low=0.0, high=0.5
    )
    noise_time: float = parameter(
        0.15, "Time over which that wanders", unit="s", low=0.01, high=10.0
    )
    threshold: float = parameter(
        0.85, "Probability of a goal from which on the person is sure", low=0.34, high=0.9999
    )
    hold: float = parameter(0.1, "For how long that must last", unit="s", low=0.0, high=5.0)
    reaction: float = parameter(0.25, "Median reaction time", unit="s", low=0.01, high=5.0)
    reaction_spread: float = parameter(
        0.20, "Standard deviation of its logarithm", low=0.0, high=2.0
    )
    hand_speed: float = parameter(1.0, "Factor on the speed of the hand", low=0.2, high=3.0)
    prior: tuple[float, ...] = field(
        default=(),
        metadata=dict(parameter((), "Log prior of each goal; none: all alike").metadata),
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)


def draw_traits(rng: np.random.Generator, goals: int) -> Traits:
    """A person of the population that policies are tuned on, for so many goals."""
    return Traits(
        rationality=float(30.0 * np.exp(0.3 * rng.standard_normal())),
        noise=float(rng.uniform(0.010, 0.025)),
        threshold=float(rng.uniform(0.65, 0.92)),
        reaction=float(0.25 * np.exp(0.2 * rng.standard_normal())),
        reaction_spread=float(rng.uniform(0.1, 0.25)),
        hand_speed=float(rng.uniform(0.85, 1.15)),
        prior=_prior(rng, goals, 0.5),
    )


def draw_other_traits(rng: np.random.Generator, goals: int) -> Traits:
    """A person unlike those: goes by headings, is less sure, sees worse, and is more biased."""
    return Traits(
        kind="heading",
        attention=float(50.0 * np.exp(0.5 * rng.standard_normal())),
        forgetting=float(rng.uniform(0.3, 1.2)),
        noise=float(rng.uniform(0.015, 0.035)),
        threshold=float(rng.uniform(0.65, 0.97)),
        reaction=float(0.35 * np.exp(0.3 * rng.standard_normal())),
        reaction_spread=float(rng.uniform(0.2, 0.4)),
        hand_speed=float(rng.uniform(0.7, 1.1)),
        prior=_prior(rng, goals, 0.8),
    )


def _prior(rng: np.random.Generator, goals: int, spread: float) -> tuple[float, ...]:
    bias: Sequence[float] = (spread * rng.standard_normal(goals)).tolist()
    return tuple(bias)


POPULATIONS: Mapping[str, Callable[[np.random.Generator, int], Traits]] = {
    "usual": draw_traits,
    "other": draw_other_traits,
}
"""Whom people are drawn from: those that policies are tuned on, and others."""


def draw_person(population: str, rng: np.random.Generator, goals: int) -> Traits:
    """A person of a population.

    Raises:
        ConfigError: for an unknown one.
    """
    if population not in POPULATIONS:
        raise ConfigError(f"people {population!r}", expected=" or ".join(POPULATIONS))
    return POPULATIONS[population](rng, goals)
