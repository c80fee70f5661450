"""Encounters as tensors: padded to the same number of steps, those of like length together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.features import FeatureConfig, features
from hri_planner.rnn.integration import accelerations, initial_velocity
from hri_planner.rnn.model import STEP_S
from hri_planner.rnn.scales import Scales, scales_of
from hri_prediction.errors import DataError


@dataclass(frozen=True, eq=False)
class Bucket:
    """Encounters of like length; the first axis is time.

    Attributes:
        inputs: Normalised features along the recorded hand (steps, batch, 6).
        labels: Normalised accelerations of the recorded hand (steps, batch, 3).
        mask: 1 where there is a label (steps, batch, 1), else 0.
    """

    inputs: Tensor
    labels: Tensor
    mask: Tensor


@dataclass(frozen=True, eq=False)
class Course:
    """Encounters to be run again in closed loop, all as long as the longest; the first axis is time.

    Attributes:
        hand: Recorded hands, held at the goal (steps + 1, batch, 3) [m].
        partner: Partners' hands, held (steps, batch, 3) [m].
        goal: Shape (batch, 3) [m].
        velocity: First velocities (batch, 3) [m/s].
    """

    hand: Tensor
    partner: Tensor
    goal: Tensor
    velocity: Tensor


def training_scales(encounters: Sequence[Encounter], config: FeatureConfig) -> Scales:
    """Scales of the recorded features and accelerations.

    Raises:
        DataError: when there are no encounters, or nothing can be learnt of them.
    """
    if not encounters:
        raise DataError("no encounters to learn from")
    seen = [features(e.hand, e.goal, e.partner, config) for e in encounters]
    told = [accelerations(e.hand, STEP_S) for e in encounters]
    return scales_of(np.concatenate(seen), np.concatenate(told))


def buckets(
    encounters: Sequence[Encounter],
    scales: Scales,
    config: FeatureConfig,
    *,
    hold: int,
    count: int = 4,
    dtype: torch.dtype = torch.float64,
) -> list[Bucket]:
    """Recorded features and labels, in a few buckets by length so that little is padded.

    Args:
        encounters: What was recorded.
        scales: Of the features.
        config: Parameters of the features.
        hold: Steps at rest at the goal that follow each of them.
        count: Buckets.
        dtype: Of the tensors.
    """
    order = sorted(range(len(encounters)), key=lambda index: len(encounters[index]))
    found = []
    for part in np.array_split(order, min(count, len(order))):
        chosen = [held(encounters[index], hold) for index in part]
        steps = max(len(hand) for hand, _, _ in chosen) - 1
        inputs, labels = np.zeros((steps, len(chosen), 6)), np.zeros((steps, len(chosen), 3))
        mask = np.zeros((steps, len(chosen), 1))
        for column, (hand, partner, goal) in enumerate(chosen):
            n = len(hand) - 1
            seen = features(hand[:-1], goal, partner[:-1], config)
            inputs[:n, column] = seen / scales.inputs
            labels[:n, column] = accelerations(hand, STEP_S) / scales.acceleration
            mask[:n, column] = 1.0
        found.append(
            Bucket(*(torch.tensor(values, dtype=dtype) for values in (inputs, labels, mask)))
        )
    return found


def course(
    encounters: Sequence[Encounter], steps: int, dtype: torch.dtype = torch.float64
) -> Course:
    """Encounters to be run again, all for so many steps: cut, or held at the goal."""
    hands, partners = (
        np.empty((steps + 1, len(encounters), 3)),
        np.empty((steps, len(encounters), 3)),
    )
    for column, one in enumerate(encounters):
        hand, partner, _ = held(one, max(steps + 1 - len(one), 0))
        hands[:, column], partners[:, column] = hand[: steps + 1], partner[:steps]
    goals = np.array([one.goal for one in encounters])
    first = np.array([initial_velocity(one.hand, STEP_S) for one in encounters])
    return Course(*(torch.tensor(v, dtype=dtype) for v in (hands, partners, goals, first)))


def held(one: Encounter, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hand, partner and goal of an encounter that goes on, both at rest, for so many steps."""
    hand = np.concatenate((one.hand, np.repeat(one.hand[-1:], steps, axis=0)))
    partner = np.concatenate((one.partner, np.repeat(one.partner[-1:], steps, axis=0)))
    return hand, partner, one.goal
