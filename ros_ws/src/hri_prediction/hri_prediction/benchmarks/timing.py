"""Time several implementations of one thing in turn, so that what disturbs one disturbs all."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Contender:
    """One implementation.

    Args:
        step: What is timed, given the number of the step.
        prepare: Called before each round, not timed.
        rounds: Takes part in so many rounds at most; a slow one need not hold up the others.
    """

    step: Callable[[int], object]
    prepare: Callable[[], object] = lambda: None
    rounds: int = 1_000_000


def time_in_turn(
    contenders: Mapping[str, Contender],
    rounds: int,
    steps: int = 1,
    progress: Callable[[], object] = lambda: None,
) -> dict[str, Array]:
    """Seconds that each step of each round took; one round more goes first and is not counted.

    Args:
        contenders: By name.
        rounds: Number of rounds.
        steps: Steps of a round; each contender does step i before any does step i + 1.
        progress: Called after each round.
    """
    taken: dict[str, list[float]] = {name: [] for name in contenders}
    order = list(contenders)
    for number in range(-1, rounds):
        order = order[1:] + order[:1]
        present = [name for name in order if number < contenders[name].rounds]
        for name in present:
            contenders[name].prepare()
        for i in range(steps):
            for name in present:
                step = contenders[name].step
                begin = time.perf_counter()
                step(i)
                passed = time.perf_counter() - begin
                if number >= 0:
                    taken[name].append(passed)
        progress()
    return {name: np.array(values) for name, values in taken.items()}
