"""What a policy is judged by: the test part of a set, drawn anew, or recordings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.rnn.encounters import Encounter
from hri_prediction.errors import DataError
from hri_sim.policies.datasets import SETS, WITHOUT_PAIR, simulated_set
from hri_sim.policies.handovers import without_pair
from hri_sim.policies.recordings import load_encounters, recorded_set, recording_hash

SIMULATED = "simulated"
MOST = 300
"""Encounters of a recording that are evaluated; of more, so many are drawn."""


@dataclass(frozen=True, eq=False)
class Judging:
    """Encounters.

    Attributes:
        name: Of the set or file.
        simulated: Whether people are simulated.
        learnt: What is learnt from in this set.
        test: To be judged by; all of a recording that the policy has not learnt from.
        apart: Whether nothing that is learnt from is in the test.
        left_out: Of the recording, as there are more than :data:`MOST`.
    """

    name: str
    simulated: bool
    learnt: tuple[Encounter, ...]
    test: tuple[Encounter, ...]
    apart: bool
    left_out: int = 0


def data_for(data: str, trained: Mapping[str, Any], seed: int) -> Judging:
    """Encounters to judge a policy by.

    Args:
        data: ``simulated``: the set that the policy learnt from by its file; or the name of a set; or
            a file of recordings: of the one that the policy learnt from the part that was kept.
        trained: How the policy came about, as its file says.
        seed: Of what is drawn anew. A set that is tested in the setups learnt from cannot be: it
            follows from the seed that the policy's file names.

    Raises:
        DataError: when the file cannot be read, or the policy's says nothing of its set.
    """
    name = str(trained.get("data", "")) if data == SIMULATED else data
    if name in SETS:
        own = trained.get("data") == name and not SETS[name].unseen
        found = simulated_set(name, int(trained.get("data_seed", seed)) if own else seed)
        return Judging(name, True, found.learnt, found.test, True)
    if data == SIMULATED:
        raise DataError(
            f"the policy's file names the data {name!r}",
            expected="one of " + ", ".join(SETS),
            hint="say by --data which set, or which recordings",
        )
    path = Path(data)
    own = bool(trained.get("data_hash")) and trained["data_hash"] == recording_hash(path)
    recorded = load_encounters(path, str(trained.get("learner", "")) if own else "")
    encounters = learnt = tuple(one.encounter for one in recorded)
    source = str(trained.get("data", ""))
    if own and source.startswith(WITHOUT_PAIR):
        others, kept = without_pair(list(encounters), source.removeprefix(WITHOUT_PAIR))
        learnt, encounters = tuple(others), tuple(kept)
    elif own:
        parts = recorded_set(recorded, int(trained.get("data_seed", 0)))
        learnt, encounters = parts.learnt, parts.test
    rows = np.arange(len(encounters))
    if len(rows) > MOST:
        rows = np.sort(np.random.default_rng(seed).choice(rows, MOST, replace=False))
    return Judging(
        data,
        False,
        learnt,
        tuple(encounters[row] for row in rows),
        own,
        len(encounters) - len(rows),
    )
