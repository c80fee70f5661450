"""Which policies the report is about, where their files are, and training those that are missing."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import read_policy
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.results.origin import results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.policies.datasets import WITHOUT_PAIR
from hri_sim.policies.table import Job, table_jobs

HEADLINE = ("C7", "C8", "C9", "C13", "C14", "C15")
"""Two layers of nine units of each kind of cells, of D1 and D2: those of which something is wanted."""

SEEDS = (0, 1, 2)
SEED_GROUP = "seed_"
HANDOVER_CELLS = {"gru3t": FeatureConfig.influence, "gru": 0.6}
"""The thesis' choice as in its tables, and what is trained by default; from where on partners are felt [m].

At the end of these handovers the giver's hand is 0.42 to 0.5 m from where the taker's goes, once in a while
0.35 m: with the thesis' 0.4 m, hardly anybody is recorded at rest where a partner is felt.
"""

PAIR = "pair_"
LARGE = "large"
LARGE_DATA = "D3-1"
LARGE_UNITS = (3, 9, 32)
"""Of each of two layers of the LSTMs by which size is held against detail."""


@dataclass(frozen=True)
class Policy:
    """One of the report's policies.

    Attributes:
        group: Folder of its file.
        job: How it is trained.
        data_seed: Of its set.
    """

    group: str
    job: Job
    data_seed: int

    @property
    def name(self) -> str:
        """``seed_0/C7``."""
        return f"{self.group}/{self.job.name}"

    def file(self, runs: Path) -> Path:
        """Of the policy."""
        return runs / self.group / f"{self.job.name}.npz"

    def read(self, runs: Path) -> PolicyModel:
        """Load it."""
        return read_policy(self.file(runs))[0]

    def is_trained(self, runs: Path) -> bool:
        """Whether its file is there, of this set, features, network and seeds; the rest is free."""
        try:
            model, trained = read_policy(self.file(runs))
        except DataError:
            return False
        return (
            model.network.kind == self.job.config.cell
            and model.network.units == self.job.config.units
            and model.features.influence == self.job.config.influence
            and trained.get("data") == self.job.data
            and trained.get("data_seed") == self.data_seed
            and (trained.get("config") or {}).get("seed") == self.job.config.seed
        )

    def record(self, runs: Path) -> dict[str, Any]:
        """What its training wrote down; nothing where that is not there."""
        try:
            found = json.loads(self.file(runs).with_suffix(".json").read_text())
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def seed_policies(config: TrainingConfig, smoke: bool) -> list[Policy]:
    """All of table 5.2 with the first seed, those of the bars with the others."""
    if smoke:
        jobs = [job for job in table_jobs(config) if job.name in HEADLINE[3:]]
        return [Policy(f"{SEED_GROUP}0", job, 0) for job in jobs]
    return [
        Policy(f"{SEED_GROUP}{seed}", job, seed)
        for seed in SEEDS
        for job in table_jobs(replace(config, seed=seed))
        if seed == SEEDS[0] or job.name in HEADLINE
    ]


def handover_group(cell: str) -> str:
    """Folder of the policies of recorded handovers."""
    return f"handover_{cell}"


def handover_policies(config: TrainingConfig, pairs: Iterable[str], smoke: bool) -> list[Policy]:
    """One for each kind of cells and pair of people, learnt from all other pairs."""
    kinds = {
        cell: replace(config, cell=cell, units=(9, 9), influence=influence)
        for cell, influence in HANDOVER_CELLS.items()
    }
    found = [
        Policy(handover_group(cell), Job(f"{PAIR}{pair}", f"{WITHOUT_PAIR}{pair}", kind), 0)
        for cell, kind in kinds.items()
        for pair in pairs
    ]
    return found[: 1 if smoke else None]


def large_policies(config: TrainingConfig, smoke: bool) -> list[Policy]:
    """LSTMs of growing size, trained with Adam in the first stage too."""
    units = LARGE_UNITS[:2] if smoke else LARGE_UNITS
    return [
        Policy(
            LARGE,
            Job(
                f"lstm_{n}x{n}",
                "D2" if smoke else LARGE_DATA,
                replace(config, cell="lstm", units=(n, n), optimiser="adam"),
            ),
            0,
        )
        for n in units
    ]


def train_missing(
    policies: Sequence[Policy], runs: Path, workers: int, progress: ProgressLine
) -> None:
    """Train those that are not there; what was broken off goes on.

    Raises:
        ConfigError: when torch is needed and is not installed.
    """
    missing = [policy for policy in policies if not policy.is_trained(runs)]
    if not missing:
        return
    if importlib.util.find_spec("torch") is None:
        names = ", ".join(policy.name for policy in missing)
        raise ConfigError(
            f"torch is not installed, and {len(missing)} policies are not trained: {names}",
            hint=".venv/bin/python -m pip install -r requirements/training.txt",
        )
    progress.say(f"training {len(missing)} policies")
    for group in {policy.group for policy in missing}:
        (runs / group).mkdir(parents=True, exist_ok=True)
    work = partial(_train, runs=runs, origin=results_origin())
    for done, _ in enumerate(do_all(work, missing, workers=workers), 1):
        progress.count(done, len(missing))


def _train(policy: Policy, runs: Path, origin: dict[str, Any]) -> Path:
    from hri_sim.policies.jobs import train_job

    return train_job(policy.job, runs / policy.group, policy.data_seed, origin)
