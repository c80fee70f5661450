"""Settings of watching two people interact."""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.config import parameter, validate


@dataclass(frozen=True)
class WatchConfig:
    """How two arms are made into features of movement segments."""

    step: float = parameter(
        0.02, "Time between the instants at which features are taken", unit="s", low=0.005, high=0.1
    )
    smoothing: float = parameter(
        0.02,
        "Samples up to so far away are smoothed by a parabola (Savitzky and Golay 1964, second order), or "
        "as far as five of them need; also so late are features",
        unit="s",
        low=0.0,
        high=0.2,
    )
    max_gap: float = parameter(
        0.1, "Longest gap that is filled by straight lines", unit="s", low=0.005, high=1.0
    )
    least_seen: float = parameter(
        0.5, "Share of a segment in which all of both arms must be seen", low=0.0, high=1.0
    )
    longest: float = parameter(
        20.0, "Segments that take longer are none", unit="s", low=1.0, high=300.0
    )
    plausible_speed: float = parameter(
        8.0,
        "A wrist that is faster has jumped: it is another one now",
        unit="m/s",
        low=1.0,
        high=50.0,
    )
    plausible_acceleration: float = parameter(
        20.0,
        "A wrist that was not seen for a while, and is farther from where it was going than this explains, "
        "has jumped",
        unit="m/s^2",
        low=1.0,
        high=200.0,
    )

    def __post_init__(self) -> None:
        """Check the ranges."""
        validate(self)
