"""How a policy is trained."""

from __future__ import annotations

from dataclasses import dataclass

from hri_planner.rnn.cells import GATES
from hri_planner.rnn.features import FeatureConfig
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError

OPTIMISERS = ("bfgs", "adam")


@dataclass(frozen=True)
class TrainingConfig:
    """Parameters of training, as of ``--config``.

    Raises:
        ConfigError: when a value is out of range.
    """

    cell: str = parameter("gru", "kind of cells", choices=tuple(GATES))
    units: tuple[int, ...] = parameter((9, 9), "units of each layer", low=1)
    seed: int = parameter(0, "of first weights, batches and noise", low=0)
    hold: int = parameter(20, "steps at rest at the goal that follow each reach", low=0)
    optimiser: str = parameter(
        "bfgs",
        "of the first stage: bfgs with all data at once, for up to some thousand weights; adam else",
        choices=OPTIMISERS,
    )
    imitation_rounds: int = parameter(2, "rounds of the first stage, at most", low=0)
    imitation_iterations: int = parameter(50, "iterations of such a round", low=1)
    imitation_rate: float = parameter(0.01, "step size of Adam in the first stage", low=1e-6)
    closed_rounds: int = parameter(24, "rounds of the second stage, in closed loop", low=0)
    closed_iterations: int = parameter(40, "iterations of such a round", low=1)
    closed_rate: float = parameter(
        0.008, "step size of Adam in the second stage, which falls to a fiftieth of it", low=1e-6
    )
    batch: int = parameter(256, "encounters of an iteration of the second stage", low=1)
    first_horizon: int = parameter(60, "steps that the second stage begins with", low=5)
    last_horizon: int = parameter(200, "steps that it ends with", low=5)
    noise: float = parameter(
        0.003, "noise of goal and partner in half of the second stage's batch", unit="m", low=0.0
    )
    terminal_weight: float = parameter(
        0.1,
        "weight of the distance to the goal late in the run, beside that to the record",
        low=0.0,
    )
    switched: float = parameter(
        0.15, "share of the second stage's goals that change on the way", low=0.0, high=0.9
    )
    clip: float = parameter(
        1.0, "longest gradient of the second stage; longer ones are cut", low=0.0
    )
    patience: int = parameter(
        8,
        "rounds without a better validation after which a stage ends; of the second, in its second half",
        low=1,
    )

    influence: float = parameter(
        FeatureConfig.influence, "d*: farther partners are not felt", unit="m", low=0.05
    )
    longest_push: float = parameter(
        FeatureConfig.longest_push,
        "at which the push away from the partner is cut; 17.5 is that of 5 cm",
        unit="1/m",
        low=0.1,
    )

    @property
    def features(self) -> FeatureConfig:
        """What the network sees."""
        return FeatureConfig(self.influence, self.longest_push)

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)
        if self.last_horizon < self.first_horizon:
            raise ConfigError(
                f"last_horizon = {self.last_horizon}", expected=f"at least {self.first_horizon}"
            )
