"""Settings of the hybrid predictor."""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.config import parameter, validate


@dataclass(frozen=True)
class HybridConfig:
    """What is taken for granted of a person before anything is seen; flat, so that nodes can declare it."""

    offset_sd: float = parameter(
        0.012,
        "how far a person's reaches usually are aside of the optimum, in each axis",
        unit="m",
        low=1e-4,
    )
    drift_sd: float = parameter(
        0.015,
        "how far, beyond that, they drift off until their end (trunk, shoulder), in each axis",
        unit="m",
        low=1e-4,
    )
    scale_sd: float = parameter(
        0.05, "by how much, relative, a person's reaches are larger or smaller", low=0.0, high=1.0
    )
    pace_sd: float = parameter(
        0.06,
        "how far, as a share of the duration, a person is usually early or late on the way",
        low=0.0,
        high=0.3,
    )
    pace_scatter_sd: float = parameter(
        0.03, "how far, likewise, single reaches are early or late", low=0.0, high=0.3
    )
    detour_sd: float = parameter(
        0.015, "how far else a person's mean path strays from the optimum", unit="m", low=1e-4
    )
    variability_sd: float = parameter(
        0.012, "spread between reaches of one person that is expected", unit="m", low=1e-4
    )
    variability_strength: float = parameter(
        12.0, "reaches that this spread counts for against the one seen", low=1.0
    )
    coupling: float = parameter(
        0.7,
        "correlation of what elbow and wrist stray by (0: the elbow says nothing of the wrist)",
        low=0.0,
        high=0.99,
    )
    duration: float = parameter(
        1.0, "of a reach before any is seen, from rest to rest", unit="s", low=0.1, high=10.0
    )
    duration_log_sd: float = parameter(0.35, "spread of the logarithm of that", low=0.01, high=2.0)
    most_reaches: int = parameter(40, "of a task that are kept; the oldest go first", low=2)
    settled: float = parameter(
        0.05,
        "Kullback-Leibler divergence by weight between updates, below which a task is known well enough "
        "to ask why the person reaches so",
        low=0.0,
    )
    settled_reaches: int = parameter(5, "fewer reaches than this settle nothing", low=2)
    place_radius: float = parameter(
        0.08, "a hand that rests, or ends a reach, so near to a target is there", unit="m", low=0.01
    )
    moved: float = parameter(
        0.02,
        "a shoulder, elbow or wrist that rests further off than this gets a new first guess",
        unit="m",
        low=0.001,
    )

    def __post_init__(self) -> None:
        validate(self)
