"""The sets D1, D2 and D3-1/2/3 (table 5.1), of simulated dyads.

As in the thesis, D1 and D2 are tested in setups from which nothing was learnt, D2 learning from fewer
of them; D3-1/2/3 learn from three setups and are tested in 5 % of the encounters there, shuffled three
ways. Everything follows from name and seed. Each setup has two people of its own, so that in D1 and
D2 the people of the test are unseen too.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hri_planner.rnn.encounters import Encounter, in_all_directions
from hri_prediction.errors import ConfigError
from hri_sim.dyads.recording import draw_encounters
from hri_sim.dyads.setups import draw_setups
from hri_sim.policies.handovers import FILE, load_handovers, without_pair


@dataclass(frozen=True)
class SetSpec:
    """What a set is made of.

    Attributes:
        setups: To learn from.
        encounters: Of each of these setups.
        unseen: Further setups, to be tested in; 0: tests are in the setups learnt from.
        test_encounters: Of each unseen setup.
        shuffle: Which shuffle, where tests are in the setups learnt from.
    """

    setups: int
    encounters: int
    unseen: int = 0
    test_encounters: int = 0
    shuffle: int = 0


SETS = {
    "D1": SetSpec(setups=12, encounters=60, unseen=6, test_encounters=40),
    "D2": SetSpec(setups=6, encounters=50, unseen=6, test_encounters=40),
    "D3-1": SetSpec(setups=3, encounters=200, shuffle=1),
    "D3-2": SetSpec(setups=3, encounters=200, shuffle=2),
    "D3-3": SetSpec(setups=3, encounters=200, shuffle=3),
}

VALIDATION_SHARE = 0.1
TEST_SHARE = 0.05

WITHOUT_PAIR = "handover-without-"
"""Begins the name of the set of recorded handovers of all pairs but the one that follows."""

RECORDINGS = "HRI_DATA_DIR"
"""Environment variable that names the folder of recordings by others."""


@dataclass(frozen=True, eq=False)
class DataSet:
    """Encounters by what they are for.

    Attributes:
        learnt: To learn from, in all directions.
        validation: By which training is ended early.
        test: Seen by no training.
    """

    learnt: tuple[Encounter, ...]
    validation: tuple[Encounter, ...]
    test: tuple[Encounter, ...]


def simulated_set(name: str, seed: int) -> DataSet:
    """A set by name.

    Raises:
        ConfigError: naming those that there are.
    """
    if name not in SETS:
        raise ConfigError(f"data set {name!r}", expected="one of " + ", ".join(SETS))
    spec = SETS[name]
    # The three shuffles are of the same encounters.
    rng = np.random.default_rng((seed, list(SETS).index("D3-1" if spec.shuffle else name)))
    setups = draw_setups(spec.setups + spec.unseen, rng)
    seen = draw_encounters(setups[: spec.setups], spec.encounters, rng)
    order = np.random.default_rng((seed, spec.shuffle)).permutation(len(seen))
    if spec.unseen:
        test = draw_encounters(setups[spec.setups :], spec.test_encounters, rng)
    else:
        count = round(TEST_SHARE * len(seen))
        test, order = [seen[index] for index in order[:count]], order[count:]
    held = round(VALIDATION_SHARE * len(order))
    learnt = [seen[index] for index in order[held:]]
    return DataSet(
        tuple(in_all_directions(learnt)),
        tuple(seen[index] for index in order[:held]),
        tuple(test),
    )


def handovers_file() -> Path:
    """The recorded handovers.

    Raises:
        ConfigError: when the environment does not say where recordings are.
    """
    folder = os.environ.get(RECORDINGS)
    if not folder:
        raise ConfigError(f"{RECORDINGS} is not set", expected=f"the folder that holds {FILE}")
    return Path(folder) / FILE


def handover_set(pair: str, seed: int) -> DataSet:
    """Recorded handovers: learnt from all pairs but one, tested with that one.

    Args:
        pair: Name of that pair.
        seed: Of what validation is drawn by.

    Raises:
        ConfigError: when the environment does not say where recordings are.
        DataError: when the file cannot be read, or there is no such pair.
    """
    others, own = without_pair(load_handovers(handovers_file()), pair)
    order = np.random.default_rng((seed, len(own))).permutation(len(others))
    held = round(VALIDATION_SHARE * len(others))
    return DataSet(
        tuple(in_all_directions([others[index] for index in order[held:]])),
        tuple(others[index] for index in order[:held]),
        tuple(own),
    )
