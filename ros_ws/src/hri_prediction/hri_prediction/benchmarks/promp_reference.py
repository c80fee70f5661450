"""The ProMP of ``movement_primitives`` (dfki-ric, BSD-3-Clause) in the same tasks, where it can.

It is one of the requirements for tests (``requirements/dev.txt``), so it is imported only when asked
for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.benchmarks.promp_plain import PlainBank
from hri_prediction.promp.learning import LearningConfig
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import Demonstration

Array = NDArray[np.float64]
NAME = "movement_primitives"


def available() -> bool:
    """Whether the package is installed."""
    try:
        import movement_primitives.promp  # noqa: F401
    except ImportError:
        return False
    return True


def reference_promp(mean: Array, covariance: Array, count: int) -> Any:
    """Its model with the given distribution of weights; its overlap is 0.7, as ours by default."""
    from movement_primitives.promp import ProMP as Reference

    return Reference(mean.size // count, count).from_weight_distribution(
        np.array(mean), np.array(covariance)
    )


def reference_learn(demonstrations: Sequence[Demonstration], config: LearningConfig) -> Any:
    """Its EM, with no prior and a noise model of its own, for as many iterations as ours at most."""
    from movement_primitives.promp import ProMP as Reference

    model = Reference(demonstrations[0].values.shape[1], config.weights_per_dim)
    model.imitate(
        np.stack([demo.phases for demo in demonstrations]),
        np.stack([demo.values for demo in demonstrations]),
        n_iter=config.iterations,
    )
    return model


class ReferenceFilter:
    """Conditioning by its ``condition_position``, which makes a new model each time."""

    def __init__(self, model: ProMP) -> None:
        self.model = reference_promp(model.mean, model.covariance, model.basis.count)
        self.noise = np.array(model.noise)

    def observe(self, phase: float, value: Array) -> None:
        """Condition on a position (D,)."""
        self.model = self.model.condition_position(value, self.noise, phase)


class ReferenceBank(PlainBank):
    """A bank whose hypotheses are conditioned one by one by ``condition_position``.

    Likelihoods and the mixture, which it does not have, are those of plain NumPy.
    """

    def restart(self) -> None:
        """Return to the prior."""
        super().restart()
        count = self.prior.basis.count
        self.models = [
            reference_promp(mean, covariance, count)
            for mean, covariance in zip(self.means, self.covariances, strict=True)
        ]

    def condition(
        self, phases: Array, value: Array, error: Array, across: Array, spread: Array
    ) -> None:
        """Condition each hypothesis on its own."""
        for h, phase in enumerate(phases):
            model = self.models[h].condition_position(value, self.prior.noises[h], phase)
            self.models[h] = model
            self.means[h], self.covariances[h] = model.weight_mean, model.weight_cov
