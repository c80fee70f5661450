"""First stage: accelerations of recorded hands, the whole sequences given (eq. 5.12)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from scipy.optimize import minimize

from hri_planner.rnn.training.adam import adam_round
from hri_planner.rnn.training.batches import Bucket
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.flat import FloatArray, flatten, unflatten
from hri_planner.rnn.training.losses import imitation_loss
from hri_planner.rnn.training.torch_network import TorchNetwork


def imitation_round(
    network: TorchNetwork,
    memory: dict[str, FloatArray],
    data: Sequence[Bucket],
    config: TrainingConfig,
) -> tuple[float, dict[str, FloatArray]]:
    """Some iterations with all data at once.

    Args:
        network: Changed in place.
        memory: Of the optimiser, from the round before.
        data: To learn from.
        config: Parameters.

    Returns:
        Loss, and what the optimiser is to remember.
    """
    if config.optimiser == "adam":
        rates = np.full(config.imitation_iterations, config.imitation_rate)
        return adam_round(
            network.weights, memory, lambda _: imitation_loss(network, data), rates, config.clip
        )
    return _bfgs_round(network, memory, data, config.imitation_iterations)


def _bfgs_round(
    network: TorchNetwork, memory: dict[str, FloatArray], data: Sequence[Bucket], iterations: int
) -> tuple[float, dict[str, FloatArray]]:
    """SciPy's BFGS (the thesis'), begun with the inverse Hessian of the round before."""
    like = network.network().to_arrays()

    def evaluate(vector: FloatArray) -> tuple[float, FloatArray]:
        network.load({n: torch.from_numpy(a.copy()) for n, a in unflatten(vector, like).items()})
        for weight in network.weights.values():
            weight.grad = None
        value = imitation_loss(network, data)
        value.backward()
        slopes = {name: weight.grad.numpy() for name, weight in network.weights.items()}
        return float(value.detach()), flatten(slopes)

    found = minimize(
        evaluate,
        flatten(like),
        jac=True,
        method="BFGS",
        options={"maxiter": iterations, "gtol": 1e-7, "hess_inv0": memory.get("inverse_hessian")},
    )
    evaluate(found.x)
    # Rounding leaves it not quite symmetric, which the next round would refuse.
    inverse = 0.5 * (found.hess_inv + found.hess_inv.T)
    return float(found.fun), {"inverse_hessian": inverse}
