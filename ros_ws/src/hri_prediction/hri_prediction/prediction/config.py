"""Settings of the online predictor and of the training of its library."""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.config import parameter, validate
from hri_prediction.promp.learning import LearningConfig
from hri_prediction.tracks.segmentation import SegmentationConfig


@dataclass(frozen=True)
class PredictorConfig:
    """Settings of `ReachPredictor` and `train_library`; flat, so that a node can declare them."""

    # -- output
    horizon: float = parameter(1.5, "how far predictions reach", unit="s", low=0.05, high=10.0)
    step: float = parameter(0.05, "time between predicted points", unit="s", low=0.005, high=1.0)
    output: str = parameter(
        "mixture",
        "mixture: moments over all hypotheses; likeliest: those of the likeliest task alone",
        choices=("mixture", "likeliest"),
    )
    # -- training
    weights_per_dim: int = parameter(8, "basis functions a dimension", low=3, high=40)
    demonstration_points: int = parameter(
        31, "points that a demonstration is resampled to", low=5, high=500
    )
    prior_strength: float = parameter(
        3.0, "demonstrations that the prior covariance counts for", low=0.01
    )
    prior_sd: float = parameter(
        0.015, "spread between reaches expected before any is seen", unit="m", low=1e-4
    )
    prior_sd_strength: float = parameter(
        0.5, "demonstrations that prior_sd counts for against the spread seen", low=0.0
    )
    person_correlation: float = parameter(
        0.8,
        "how alike one person's reaches are in a library of several persons (0 independent, "
        "1 the same); larger makes regions for a new person wider",
        low=0.0,
        high=1.0,
    )
    smoothness: float = parameter(
        0.4,
        "phase over which deviations stay alike; larger lets the start say more about the end",
        low=0.01,
        high=10.0,
    )
    noise_sd: float = parameter(
        0.0032,
        "smallest deviation of a sample from a hypothesis (noise, misfit); larger reacts slower",
        unit="m",
        low=1e-4,
    )
    min_demonstrations: int = parameter(1, "fewer than this make no task", low=1)
    # -- hypotheses
    durations: int = parameter(21, "duration hypotheses a task", low=1, high=201)
    duration_range: float = parameter(
        2.2, "half width of the duration grid, in standard deviations of log duration", low=0.1
    )
    min_duration_cv: float = parameter(
        0.1, "smallest relative standard deviation of a task's duration", low=0.01, high=2.0
    )
    update_interval: float = parameter(
        0.02,
        "time between filter updates; neighbouring samples share their errors",
        unit="s",
        low=0.001,
        high=0.2,
    )
    evidence_weight: float = parameter(
        1.0,
        "share of each log likelihood that counts; below 1 makes up for correlated misfit",
        low=0.001,
        high=1.0,
    )
    switching: float = parameter(
        0.005,
        "probability per update of falling back to the prior, so that beliefs can change",
        low=0.0,
        high=0.5,
    )
    change_rate: float = parameter(
        0.01,
        "changes of mind expected a second: how readily a reach is taken to be re-aimed (0: never)",
        unit="1/s",
        low=0.0,
        high=5.0,
    )
    reaim_sd: float = parameter(
        0.05,
        "spread added to the ends of re-aimed reaches, at first and in each second",
        unit="m",
        low=0.0,
    )
    unknown_probability: float = parameter(
        0.05, "prior probability that a reach is none of the library's tasks", low=1e-6, high=1.0
    )
    unknown_sd: float = parameter(
        0.25,
        "spread of the displacement of an unknown reach; larger where the library's reaches are longer",
        unit="m",
        low=0.01,
    )
    unknown_duration_sd: float = parameter(
        0.3,
        "spread of the logarithm of its duration, on top of that of the library's reaches",
        low=0.01,
        high=2.0,
    )
    unknown_detour_sd: float = parameter(
        0.1, "how far it strays from a minimum-jerk line (standard deviation)", unit="m", low=0.001
    )
    inflation: float = parameter(
        1.0, "factor on the predicted covariance (calibration)", low=0.01, high=100.0
    )
    calibration_rate: float = parameter(
        0.05,
        "how fast regions widen where this person was outside of them (0: never); the logarithm "
        "of the factor rises by 0.95 of this a miss and falls by 0.05 of it a hit",
        low=0.0,
        high=1.0,
    )
    calibration_limit: float = parameter(
        100.0, "largest factor on the predicted covariance from online calibration", low=1.0
    )
    pace_sd: float = parameter(
        0.07,
        "uncertainty of the pace to come, relative: widens predictions along the direction of "
        "motion by pace_sd * horizon * speed",
        low=0.0,
        high=1.0,
    )
    anchor_time: float = parameter(
        0.1, "time over which the offset between newest sample and model fades", unit="s", low=0.0
    )
    # -- idle and library-free prediction
    idle_sd: float = parameter(0.01, "standard deviation of a resting arm", unit="m", low=1e-4)
    idle_growth: float = parameter(
        0.03, "growth of the resting arm's standard deviation per second", unit="m/s", low=0.0
    )
    velocity_window: float = parameter(
        0.1, "window of the velocity for constant-velocity prediction", unit="s", low=0.02
    )
    velocity_acceleration_sd: float = parameter(
        2.0, "acceleration assumed by constant-velocity prediction", unit="m/s^2", low=0.01
    )
    shoulder_sd: float = parameter(0.015, "standard deviation of the shoulder", unit="m", low=1e-4)
    hand_sd: float = parameter(
        0.02, "standard deviation of the hand tip about the wrist", unit="m", low=1e-4
    )
    hand_length: float = parameter(
        0.09, "wrist to hand tip, until a hand tip is seen", unit="m", low=0.01, high=0.4
    )
    # -- segmentation
    buffer_time: float = parameter(
        0.5, "samples kept for the back-dated start of a reach", unit="s", low=0.05, high=5.0
    )
    on_speed: float = parameter(
        0.08, "wrist speed above which a reach has begun", unit="m/s", low=0.001
    )
    onset_speed: float = parameter(
        0.04, "wrist speed at which onset and end are placed", unit="m/s", low=0.0005
    )
    speed_window: float = parameter(0.1, "regression window of the wrist speed", unit="s", low=0.02)
    rest_time: float = parameter(0.12, "time at rest that ends a reach", unit="s", low=0.0)
    min_reach: float = parameter(0.25, "shorter movements are no reaches", unit="s", low=0.0)
    # -- input checks
    stale_time: float = parameter(
        0.1,
        "longest time without a usable sample; then the prediction is invalid",
        unit="s",
        low=0.005,
    )
    max_gap: float = parameter(
        0.3, "longest time without a wrist that a reach survives", unit="s", low=0.005
    )
    max_speed: float = parameter(6.0, "faster motion is a jump", unit="m/s", low=0.1)
    jump_allowance: float = parameter(
        0.03, "distance that noise may add between samples", unit="m", low=0.0
    )
    length_tolerance: float = parameter(
        0.3, "relative deviation of a segment length that is still plausible", low=0.01, high=2.0
    )
    max_reach: float = parameter(1.1, "largest distance from shoulder to wrist", unit="m", low=0.1)

    def __post_init__(self) -> None:
        validate(self)
        self.segmentation  # noqa: B018  (its own checks, raised here rather than in mid-run)

    @property
    def segmentation(self) -> SegmentationConfig:
        """The segmentation's part of these settings."""
        return SegmentationConfig(
            window=self.speed_window,
            on_speed=self.on_speed,
            onset_speed=self.onset_speed,
            rest_time=self.rest_time,
            min_duration=self.min_reach,
            max_gap=self.max_gap,
            max_back_date=min(0.4, self.buffer_time),
        )

    @property
    def learning(self) -> LearningConfig:
        """The learner's part of these settings."""
        return LearningConfig(
            weights_per_dim=self.weights_per_dim,
            prior_strength=self.prior_strength,
            prior_sd=self.prior_sd,
            prior_sd_strength=self.prior_sd_strength,
            smoothness=self.smoothness,
            noise_floor=self.noise_sd,
        )
