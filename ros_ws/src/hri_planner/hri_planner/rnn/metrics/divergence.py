"""KL divergence of two sets of paths, through a ProMP of each (section 5.4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.promp.learning import LearningConfig, learn
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import Demonstration

FloatArray = NDArray[np.float64]

LEARNING = LearningConfig(weights_per_dim=8)
"""Fixed, as divergences of different bases or shrinkages are not comparable."""

LEAST_PATHS = 4


def path_model(paths: Sequence[FloatArray]) -> ProMP:
    """Distribution of paths (n_i, 3) [m] over their phase."""
    return learn(
        [Demonstration(np.linspace(0.0, 1.0, len(path)), path) for path in paths], LEARNING
    )


def divergence(human: Sequence[FloatArray], made: Sequence[FloatArray]) -> float:
    """KL(human || made) in nats.

    Raises:
        DataError: when there are fewer than four paths of either.
    """
    if min(len(human), len(made)) < LEAST_PATHS:
        raise DataError(
            f"{len(human)} and {len(made)} paths", expected=f"at least {LEAST_PATHS} of both"
        )
    return path_model(human).kl_divergence(path_model(made))


def human_floor(human: Sequence[FloatArray], rng: np.random.Generator, splits: int = 10) -> float:
    """Median divergence of one random half of the human paths from the other: what people differ by.

    Raises:
        DataError: when there are fewer than eight paths.
    """
    found = []
    for _ in range(splits):
        order = rng.permutation(len(human))
        halves = order[: len(order) // 2], order[len(order) // 2 :]
        found.append(divergence(*([human[index] for index in half] for half in halves)))
    return float(np.median(found))
