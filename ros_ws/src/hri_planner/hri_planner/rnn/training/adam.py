"""torch's Adam, for one round at a time: what it remembers goes out and comes in as arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

FloatArray = NDArray[np.float64]


def adam_round(
    weights: Mapping[str, Tensor],
    memory: Mapping[str, FloatArray],
    loss: Callable[[int], Tensor],
    rates: FloatArray,
    clip: float,
) -> tuple[float, dict[str, FloatArray]]:
    """Some iterations.

    Args:
        weights: Changed in place.
        memory: Of the round before; empty: there was none.
        loss: Of an iteration.
        rates: Step size of each iteration (n,).
        clip: Longest gradient; longer ones are cut.

    Returns:
        Mean loss, and what to remember.
    """
    names = sorted(weights)
    optimiser = torch.optim.Adam([weights[name] for name in names], lr=float(rates[0]))
    if memory:
        optimiser.load_state_dict({
            "state": {
                index: {
                    "step": torch.tensor(float(memory["step"])),
                    "exp_avg": torch.tensor(memory[f"mean.{name}"]),
                    "exp_avg_sq": torch.tensor(memory[f"square.{name}"]),
                }
                for index, name in enumerate(names)
            },
            "param_groups": optimiser.state_dict()["param_groups"],
        })  # fmt: skip
    total = 0.0
    for index, rate in enumerate(rates):
        optimiser.param_groups[0]["lr"] = float(rate)
        optimiser.zero_grad()
        value = loss(index)
        value.backward()
        torch.nn.utils.clip_grad_norm_([weights[name] for name in names], clip)
        optimiser.step()
        total += float(value.detach())
    kept: dict[str, FloatArray] = {}
    for index, name in enumerate(names):
        state = optimiser.state_dict()["state"][index]
        kept["step"] = np.array(float(state["step"]))
        kept[f"mean.{name}"] = state["exp_avg"].double().numpy().copy()
        kept[f"square.{name}"] = state["exp_avg_sq"].double().numpy().copy()
    return total / len(rates), kept
