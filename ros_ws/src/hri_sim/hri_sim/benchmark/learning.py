"""What a task's predictor has learnt: its recorded reaches, and the library made of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hri_prediction.prediction import TaskLibrary, train_library
from hri_sim.benchmark.conditions import SPLITS, TASKS, task_conditions
from hri_sim.people.training import scenario_training

_ENTROPY = 20160101


@lru_cache(maxsize=4 * TASKS)
def task_library(split: str, number: int) -> TaskLibrary:
    """The library of a task, learnt from 25 recorded reaches to each of its targets.

    They are drawn apart from those of the conditions. A process learns it once.
    """
    scenario = task_conditions(split, number).conditions[0].scenario
    seed = np.random.SeedSequence(_ENTROPY, spawn_key=(SPLITS.index(split), number))
    reaches = scenario_training(scenario, 0, np.random.default_rng(seed))
    return train_library(track for tracks in reaches.values() for track in tracks)
