"""Training from the first weights to a policy, in rounds that can be gone on from."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import STEP_S, PolicyModel
from hri_planner.rnn.network import Network, new_network
from hri_planner.rnn.scales import Scales
from hri_planner.rnn.training.batches import Bucket, Course, buckets, course, training_scales
from hri_planner.rnn.training.closed_loop import closed_round, course_loss
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.imitation import imitation_round
from hri_planner.rnn.training.losses import closed_loop, imitation_loss
from hri_planner.rnn.training.state import TrainingState, load_state, save_state
from hri_planner.rnn.training.torch_network import TorchNetwork
from hri_prediction.errors import DataError

STAGES = ("imitation", "closed_loop", "done")


@dataclass(frozen=True, eq=False)
class TrainingData:
    """Encounters to learn from, and others by which training is ended early.

    Attributes:
        learnt: To learn from.
        validation: Never learnt from.
    """

    learnt: Sequence[Encounter]
    validation: Sequence[Encounter]

    @property
    def digest(self) -> str:
        """Hash of all that is in them."""
        found = hashlib.sha256()
        for part in (self.learnt, self.validation):
            found.update(f"{len(part)} encounters".encode())
            for one in part:
                for values in (one.hand, one.partner, one.goal):
                    found.update(str(values.shape).encode())
                    found.update(np.ascontiguousarray(values).tobytes())
        return found.hexdigest()[:16]


@dataclass(frozen=True, eq=False)
class _Prepared:
    """Data as the stages take it."""

    scales: Scales
    features: FeatureConfig
    learnt: list[Bucket]
    validation: list[Bucket]
    course: Course
    validation_course: Course


@dataclass(frozen=True, eq=False)
class Trained:
    """What came of it.

    Attributes:
        model: The policy.
        history: A line for each round: stage, round, loss, validation.
        processor_seconds: That all rounds took, also those before training was broken off [s].
    """

    model: PolicyModel
    history: tuple[dict[str, Any], ...]
    processor_seconds: float


def train(
    data: TrainingData,
    config: TrainingConfig,
    *,
    checkpoint: Path | None = None,
    progress: Callable[[TrainingState], None] | None = None,
) -> Trained:
    """Train a policy.

    Training that was broken off and goes on from its checkpoint ends in the same weights, to the bit,
    as training that was not.

    Args:
        data: What to learn from.
        config: Parameters.
        checkpoint: File that is written after each round, and gone on from.
        progress: Called after each round.

    Raises:
        DataError: when there is nothing to learn from, when training diverges, or when the checkpoint
            is damaged or another training's.
    """
    torch.set_num_threads(1)
    prepared = _prepare(data, config, config.features)
    what = hashlib.sha256(
        json.dumps([asdict(config), asdict(prepared.features), data.digest]).encode()
    ).hexdigest()[:16]
    state = load_state(checkpoint, what) if checkpoint else None
    if state is None:
        rng = np.random.default_rng(config.seed)
        network = new_network(config.cell, config.units, rng)
        weights = network.to_arrays()
        state = TrainingState(
            "imitation", 0, weights, weights, np.inf, 0, {}, rng.bit_generator.state
        )
    while state.stage != "done":
        begin = time.process_time()
        state = _round(state, prepared, config)
        took = time.process_time() - begin
        state = replace(state, processor_seconds=state.processor_seconds + took)
        if checkpoint:
            save_state(checkpoint, state, what)
        if progress:
            progress(state)
    network = Network.from_arrays(dict(state.best), config.cell, config.units)
    model = PolicyModel(network, prepared.scales, prepared.features)
    history = tuple(dict(line) for line in state.history)
    return Trained(model, history, state.processor_seconds)


def _prepare(data: TrainingData, config: TrainingConfig, features: FeatureConfig) -> _Prepared:
    if not data.validation:
        raise DataError("no encounters to end training by", expected="one at least")
    scales = training_scales(data.learnt, features)
    return _Prepared(
        scales,
        features,
        buckets(data.learnt, scales, features, hold=config.hold),
        buckets(data.validation, scales, features, hold=config.hold),
        course(data.learnt, config.last_horizon),
        course(data.validation, config.last_horizon),
    )


def _round(state: TrainingState, data: _Prepared, config: TrainingConfig) -> TrainingState:
    """The state after another round, or at the beginning of the next stage."""
    rounds = {"imitation": config.imitation_rounds, "closed_loop": config.closed_rounds}
    if state.round >= rounds[state.stage] or state.stale >= config.patience:
        following = STAGES[STAGES.index(state.stage) + 1]
        best = state.best
        return replace(
            state, stage=following, round=0, weights=best, memory={}, stale=0,
            best_value=state.best_value if following == "done" else np.inf,
        )  # fmt: skip
    rng = np.random.default_rng()
    rng.bit_generator.state = dict(state.generator)
    network = TorchNetwork(Network.from_arrays(dict(state.weights), config.cell, config.units))
    memory = dict(state.memory)
    if state.stage == "imitation":
        loss, memory = imitation_round(network, memory, data.learnt, config)
    else:
        loss, memory = closed_round(
            network, memory, data.course, data.scales, data.features, config, state.round, rng
        )
    value = _validate(network, state.stage, data, config)
    if not np.isfinite((loss, value)).all():
        raise DataError(
            f"training diverged: {state.stage} round {state.round + 1}: loss {loss:g}, "
            f"validation {value:g}",
            expected="finite ones",
            hint="lower closed_rate, imitation_rate or clip, or look for jumps in the recordings",
        )
    weights = network.network().to_arrays()
    better = value < state.best_value
    # While the horizon is short, validation over the whole one says little of what is being learnt.
    early = state.stage == "closed_loop" and 2 * state.round < config.closed_rounds
    line = {"stage": state.stage, "round": state.round, "loss": loss, "validation": value}
    return replace(
        state,
        round=state.round + 1,
        weights=weights,
        best=weights if better else state.best,
        best_value=value if better else state.best_value,
        stale=0 if better or early else state.stale + 1,
        memory=memory,
        generator=rng.bit_generator.state,
        history=(*state.history, line),
    )


def _validate(network: TorchNetwork, stage: str, data: _Prepared, config: TrainingConfig) -> float:
    with torch.no_grad():
        if stage == "imitation":
            return float(imitation_loss(network, data.validation))
        found = data.validation_course
        moved = closed_loop(
            network, found, data.scales, data.features, STEP_S, steps=len(found.partner)
        )
        return float(course_loss(moved, found, config.terminal_weight))
