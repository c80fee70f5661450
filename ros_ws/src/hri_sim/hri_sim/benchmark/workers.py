"""Work done by many: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import contextlib
import functools
import importlib.metadata
import importlib.util
import subprocess
import sys
import warnings
from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

import joblib

from hri_prediction.compiled import processor
from hri_prediction.errors import ConfigError
from hri_prediction.results.dependencies import dependency_hash

Item = TypeVar("Item")
Result = TypeVar("Result")

WORK = "hri_sim.benchmark.run"
"""The module that outcomes come from: what it depends on decides about them."""
_CONNECT_S = 10.0


@functools.cache
def compile_kernels() -> None:
    """Fill the cache of compiled kernels, in a process of its own, once.

    Code that has just been compiled rounds otherwise in the last bit than the same code read from the
    cache (fused operations, other inlining); processes that find the cache filled all round alike.
    """
    code = "from hri_sim.warm import warm_kernels; warm_kernels()"
    subprocess.run([sys.executable, "-c", code], check=True)


def do_all(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int,
    scheduler: str | None = None,
) -> Generator[Result, None, None]:
    """Results in the order in which they are finished.

    Args:
        work: A function of a module.
        items: What to call it with.
        workers: Processes, when there is no scheduler.
        scheduler: Address of a Dask scheduler, as ``tcp://host:8786``; none: this machine.

    Raises:
        ConfigError: when Dask is not installed, no scheduler answers, it has no workers, or they run
            other sources than these.
    """
    if scheduler is None:
        return _local(work, items, workers)
    return _cluster(work, items, scheduler)


def _local(
    work: Callable[[Item], Result], items: Sequence[Item], workers: int
) -> Generator[Result, None, None]:
    compile_kernels()
    parallel = joblib.Parallel(n_jobs=workers, return_as="generator_unordered")
    results = parallel(joblib.delayed(work)(item) for item in items)
    with warnings.catch_warnings(), contextlib.closing(results):
        # When this is broken off, joblib would warn that work is lost. It is not: it is done next time.
        warnings.filterwarnings("ignore", ".*tasks which were still being processed")
        yield from results


def _cluster(
    work: Callable[[Item], Result], items: Sequence[Item], scheduler: str
) -> Generator[Result, None, None]:
    if importlib.util.find_spec("distributed") is None:
        raise ConfigError(
            "--scheduler needs Dask, which is not installed",
            hint="run: .venv/bin/python -m pip install -r requirements/cluster.txt",
        )
    from distributed import Client, as_completed

    try:
        client = Client(scheduler, timeout=_CONNECT_S)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(
            f"no Dask scheduler answers at {scheduler} ({reason})",
            expected="an address as in tcp://127.0.0.1:8786",
        ) from error
    with client:
        _check_workers(client, scheduler)
        client.run(compile_kernels)
        futures = client.map(work, items, pure=False)
        for batch in as_completed(futures, with_results=True).batches():
            for _, result in batch:
                yield result


def versions() -> dict[str, str]:
    """Versions of what outcomes are computed with, by package."""
    return {
        name: importlib.metadata.version(name) for name in ("numpy", "scipy", "numba", "mujoco")
    }


def _computed_with() -> dict[str, str]:
    """All that decides about the last bit of an outcome; called on workers."""
    return {"sources": dependency_hash(WORK), "processor": processor(), **versions()}


def _check_workers(client: Any, scheduler: str) -> None:
    """Refuse workers that would measure other code, or whose results round otherwise."""
    theirs = client.run(_computed_with)
    if not theirs:
        raise ConfigError(f"the scheduler at {scheduler} has no workers")
    ours = _computed_with()
    for name, found in sorted(theirs.items()):
        for what, value in ours.items():
            if found[what] != value:
                raise ConfigError(
                    f"worker {name} has {what} {found[what]}",
                    expected=f"{value}, as here",
                    hint="the same checkout, environment and kind of processor on all machines",
                )
