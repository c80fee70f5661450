"""Training jobs: from a set's name and a configuration to a policy in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hri_planner.rnn.model_file import read_policy, save_policy
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.errors import ConfigError, DataError
from hri_sim.policies.datasets import (
    SETS,
    WITHOUT_PAIR,
    DataSet,
    handover_set,
    handovers_file,
    simulated_set,
)
from hri_sim.policies.recordings import load_encounters, recorded_set, recording_hash
from hri_sim.policies.table import Job

if TYPE_CHECKING:
    from hri_planner.rnn.training.state import TrainingState

Said = Callable[[int, int, str], None]
"""Is told rounds done, of how many at most, and how good the policy is by now."""


def rounds(job: Job) -> int:
    """Of both stages, at most."""
    return job.config.imitation_rounds + job.config.closed_rounds


def job_data(job: Job, data_seed: int) -> DataSet:
    """What a job learns from, and what is kept from it.

    Raises:
        ConfigError: on an unknown name.
        DataError: when a recording cannot be used.
    """
    if job.data.startswith(WITHOUT_PAIR):
        return handover_set(job.data.removeprefix(WITHOUT_PAIR), data_seed)
    if is_recording(job.data):
        return recorded_set(load_encounters(Path(job.data), job.learner), data_seed)
    return simulated_set(job.data, data_seed)


def is_recording(data: str) -> bool:
    """Whether data are a recording's, not a set's of a name."""
    return data not in SETS and not data.startswith(WITHOUT_PAIR) and Path(data).exists()


def made_of(job: Job, data_seed: int) -> dict[str, Any]:
    """What decides about a job's policy; of recordings also their content.

    Raises:
        DataError: when a recording cannot be read.
    """
    file = Path(job.data) if is_recording(job.data) else None
    name = file.name if file else job.data
    if job.data.startswith(WITHOUT_PAIR):
        file = handovers_file()
    made = {"data": name, "data_seed": data_seed, "config": _plain(asdict(job.config))}
    if file:
        made |= {"data_hash": recording_hash(file), "learner": job.learner}
    return made


def train_job(
    job: Job, folder: Path, data_seed: int, origin: dict[str, Any], said: Said | None = None
) -> Path:
    """Train a policy, or go on with its training; one that is done is left as it is.

    Args:
        job: What to train.
        folder: Gets ``NAME.npz``, ``NAME.json`` (how it came about, a line for each round), and
            meanwhile ``NAME.training.npz``, from which training goes on.
        data_seed: Of the set.
        origin: Of what is made, for the files.
        said: Called after each round.

    Returns:
        The policy's file.

    Raises:
        ConfigError: when the folder has a policy of this name that was made otherwise.
        DataError: when a recording or the checkpoint cannot be used, or training diverges.
    """
    path = folder / f"{job.name}.npz"
    checkpoint = folder / f"{job.name}.training.npz"
    made = made_of(job, data_seed)
    if is_trained(path, made):
        return path
    # Only here is torch needed.
    from hri_planner.rnn.training.run import TrainingData, train

    data = job_data(job, data_seed)
    done = [0]

    def progress(state: TrainingState) -> None:
        if state.history and len(state.history) != done[0]:
            done[0] = len(state.history)
            if said:
                line = state.history[-1]
                stage = str(line["stage"]).replace("_", " ")
                said(done[0], rounds(job), f"{stage}, validation {line['validation']:.4g}")

    found = train(
        TrainingData(data.learnt, data.validation),
        job.config,
        checkpoint=checkpoint,
        progress=progress,
    )
    trained = {**made, "origin": origin}
    told = {**trained, "processor_seconds": found.processor_seconds, "rounds": found.history}
    # The policy last, for it says that all is done.
    (folder / f"{job.name}.json").write_text(json.dumps(told, indent=1) + "\n")
    save_policy(path, found.model, trained)
    checkpoint.unlink()
    return path


def is_trained(path: Path, made: dict[str, Any]) -> bool:
    """Whether a file holds the policy that would be made; a damaged one does not.

    Raises:
        ConfigError: when it holds another one, which must not be lost without a word.
    """
    if not path.is_file():
        return False
    try:
        trained = read_policy(path)[1]
    except DataError:
        return False
    if isinstance(trained.get("config"), dict):
        # A parameter that has come since was at its default.
        trained = {**trained, "config": {**_plain(asdict(TrainingConfig())), **trained["config"]}}
    other = sorted(_differing(made, trained))
    if other:
        raise ConfigError(
            f"{path}: a policy that was made otherwise ({', '.join(other)})",
            hint="write elsewhere, or remove it",
        )
    return True


def _differing(made: dict[str, Any], trained: dict[str, Any]) -> list[str]:
    """What two policies differ in, of parameters each."""
    found = []
    for name, value in made.items():
        other = trained.get(name)
        if isinstance(value, dict) and isinstance(other, dict):
            found += _differing(value, other)
        elif other != value:
            found.append(name if isinstance(value, dict) else f"{name} {other}, not {value}")
    return found


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """As JSON gives them back."""
    plain: dict[str, Any] = json.loads(json.dumps(values))
    return plain
