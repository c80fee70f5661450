"""Which generator draws what, so that a live run and its offline twin see the same person."""

from __future__ import annotations

import zlib

import numpy as np

_REACH, _TRACKING, _TRAINING, _POPULATION, _CHANGE, _DYAD = 1, 2, 3, 4, 5, 6


def _generator(seed: int, stream: int, body_id: str, index: int) -> np.random.Generator:
    return np.random.default_rng([seed, stream, zlib.crc32(body_id.encode()), index])


def reach_generator(seed: int, body_id: str, reach: int) -> np.random.Generator:
    """Motor variability of one reach of one person."""
    return _generator(seed, _REACH, body_id, reach)


def tracking_generator(seed: int, body_id: str, arm: int = 0) -> np.random.Generator:
    """Noise and drop-outs of the tracking of one arm of a person: the one that reaches is number 0."""
    return _generator(seed, _TRACKING, body_id, arm)


def training_generator(seed: int, body_id: str, reach: int) -> np.random.Generator:
    """The reaches that a predictor learned from: never those of the run itself."""
    return _generator(seed, _TRAINING, body_id, reach)


def population_generator(seed: int, body_id: str, index: int) -> np.random.Generator:
    """One person of a population (index 0), or one of that person's recorded reaches (from 1 on)."""
    return _generator(seed, _POPULATION, body_id, index)


def change_generator(seed: int, body_id: str, reach: int) -> np.random.Generator:
    """When and to where a reach of a person is diverted."""
    return _generator(seed, _CHANGE, body_id, reach)


def dyad_generator(seed: int) -> np.random.Generator:
    """All that the two people of a dyad are and do."""
    return _generator(seed, _DYAD, "", 0)
