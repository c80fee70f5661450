"""Command line of ``scripts/train_rnn.py``."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.config import load_yaml
from hri_prediction.errors import ConfigError
from hri_prediction.results.options import Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.policies.datasets import SETS, WITHOUT_PAIR
from hri_sim.policies.jobs import is_recording, train_job
from hri_sim.policies.table import Job, table_jobs

SMOKE: dict[str, Any] = {
    "units": (3, 3), "imitation_rounds": 1, "imitation_iterations": 3, "closed_rounds": 2,
    "closed_iterations": 2, "batch": 16, "first_horizon": 20, "last_horizon": 40,
}  # fmt: skip

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def check_torch() -> None:
    """Raise unless torch is there.

    Raises:
        ConfigError: saying how to install it.
    """
    if importlib.util.find_spec("torch") is None:
        raise ConfigError(
            "torch is not installed",
            expected="it for training; policies that are trained need none",
            hint=".venv/bin/python -m pip install -r requirements/training.txt",
        )


def train_all(
    jobs: Sequence[Job], out: Path, data_seed: int, workers: int, progress: ProgressLine
) -> None:
    """Train policies, several at once; those that are done are left as they are."""
    origin = results_origin()
    if len(jobs) == 1:
        (job,) = jobs

        def said(done: int, of: int, text: str) -> None:
            progress.count(done, of, text)

        progress.say(job.name)
        train_job(job, out, data_seed, origin, said)
        return
    progress.say(f"{len(jobs)} policies")
    work = partial(_train_one, folder=out, data_seed=data_seed, origin=origin)
    for done, _ in enumerate(do_all(work, jobs, workers=workers), 1):
        progress.count(done, len(jobs))


def _train_one(job: Job, folder: Path, data_seed: int, origin: dict[str, Any]) -> Path:
    return train_job(job, folder, data_seed, origin)


def chosen_jobs(
    config: TrainingConfig, data: str, learner: str, table: bool, only: str
) -> list[Job]:
    """What is to be trained.

    Raises:
        ConfigError: when a name is not known, or options contradict each other.
    """
    recorded = is_recording(data)
    if data not in SETS and not recorded and not data.startswith(WITHOUT_PAIR):
        raise ConfigError(
            f"--data {data}", expected=f"one of {', '.join(SETS)}, or a recording that exists"
        )
    if learner and not recorded:
        raise ConfigError(
            f"--learner {learner} with --data {data}", hint="give a recording as --data"
        )
    if table and recorded:
        raise ConfigError(f"--table with --data {data}", hint="leave one of them away")
    if not table:
        if only:
            raise ConfigError(f"--only {only} without --table", hint="add --table")
        units = "x".join(map(str, config.units))
        called = re.sub(r"\W+", "_", f"{Path(data).stem} {learner}".strip()) if recorded else data
        return [Job(f"rnn_{config.cell}_{units}_{called.lower()}", data, config, learner)]
    jobs = {job.name: job for job in table_jobs(config)}
    names = [name.strip() for name in only.split(",")] if only else list(jobs)
    unknown = [name for name in names if name not in jobs]
    if unknown:
        raise ConfigError(f"--only {', '.join(unknown)}", expected="some of " + ", ".join(jobs))
    return [jobs[name] for name in names]


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def train_rnn(
    out: Annotated[Path, typer.Option(help="Folder for policies (.npz) and how they came about.")],
    config: Annotated[
        Path | None,
        typer.Option(help="YAML file of training parameters; the others keep their defaults."),
    ] = None,
    data: Annotated[
        str,
        typer.Option(
            help="What to learn from: "
            + ", ".join(SETS)
            + " (simulated), or a recording of two people: a bag, a track file, a folder of these; "
            + f"{WITHOUT_PAIR}PAIR are the recorded handovers (HRI_DATA_DIR) but for a pair's."
        ),
    ] = "D1",
    learner: Annotated[
        str, typer.Option(help="Of a recording, who is learnt from (default: both people).")
    ] = "",
    data_seed: Annotated[
        int, typer.Option(help="Of the simulated dyads, and of what is kept for tests.", min=0)
    ] = 0,
    seed: Annotated[
        int | None, typer.Option(help="Of weights, batches and noise (default: the file's).", min=0)
    ] = None,
    table: Annotated[
        bool, typer.Option("--table", help="All 24 configurations of table 5.2 instead of one.")
    ] = False,
    only: Annotated[str, typer.Option(help="Some of these, as C7,C8.")] = "",
    workers: Workers = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="A tiny network and a few iterations (seconds).")
    ] = False,
) -> None:
    """Learn from two people how to move a hand beside a partner's.

    First accelerations of recorded hands, then hands that the policy moves itself. Training that was
    broken off goes on where it stopped, and ends in the same policy.
    """
    console = Console()
    check_torch()
    found = load_yaml(TrainingConfig, config) if config else TrainingConfig()
    if seed is not None:
        found = replace(found, seed=seed)
    if smoke:
        found = replace(found, **SMOKE)
    jobs = chosen_jobs(found, data, learner, table, only)
    make_folders(out=out)
    with resumable(console, out), ProgressLine(console) as progress:
        train_all(jobs, out, data_seed, workers or available_cores(), progress)
    for job in jobs:
        console.print(f"policy: {out / job.name}.npz", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="train_rnn.py")
    return 0
