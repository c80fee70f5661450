"""Parameters of the adaptation node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.pibb.names import check_name
from hri_planner.pibb.recording import AnswerConfig
from hri_prediction.config import parameter


@dataclass(frozen=True)
class AdaptationConfig(AnswerConfig):
    """What the node needs to know."""

    experiment: str = parameter(
        "transfer", "What is done: a .yaml file, or an experiment that ships"
    )
    folder: str = parameter(
        "", "Where the trials are kept; if it holds some already, they go on from there"
    )
    person: str = parameter("person1", "Who takes part; a name for files")
    seed: int = parameter(0, "Seed of the exploration and of the order of goals", low=0)
    policy: str = parameter(
        "", "Policy to begin with, a .npz file; empty: straight ways. Ways from another start or to "
        "other places are turned and stretched",
    )  # fmt: skip
    pause: float = parameter(0.6, "Rest before each motion", unit="s", low=0.1, high=60.0)
    answer_timeout: float = parameter(
        4.0, "A trial without an answer so long after the robot has arrived is broken off", unit="s",
        low=0.5, high=600.0,
    )  # fmt: skip
    beside: float = parameter(
        0.06, "A robot that is kept clear of people so near to its goal has arrived, when the person has "
        "answered; 0: it has to be there", unit="m", low=0.0, high=0.3,
    )  # fmt: skip
    beside_time: float = parameter(
        1.5, "And its motion should have been over for so long", unit="s", low=0.2, high=20.0
    )
    most_aborted: int = parameter(
        5, "So many trials broken off one after the other end the experiment", low=1, high=1000
    )
    max_future: float = parameter(
        0.05, "A stamp of people further ahead of the clock than this is refused", unit="s", low=0.0
    )
    radius_upper_arm: float = parameter(
        0.05, "Radius of the upper arm", unit="m", low=0.0, high=0.3
    )
    radius_forearm: float = parameter(0.04, "Radius of the forearm", unit="m", low=0.0, high=0.3)
    radius_hand: float = parameter(0.05, "Radius of the hand", unit="m", low=0.0, high=0.3)

    @property
    def radii(self) -> NDArray[np.float64]:
        """Of upper arm, forearm and hand (3,) [m]."""
        return np.array([self.radius_upper_arm, self.radius_forearm, self.radius_hand])

    def __post_init__(self) -> None:
        """Check the values."""
        super().__post_init__()
        check_name("person", self.person)
