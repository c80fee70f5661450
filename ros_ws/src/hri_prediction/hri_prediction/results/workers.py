"""Work done by many: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import contextlib
import importlib.metadata
import importlib.util
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any, TypeVar

import joblib

from hri_prediction.compiled import processor
from hri_prediction.errors import ConfigError
from hri_prediction.results.dependencies import dependency_hash

Item = TypeVar("Item")
Result = TypeVar("Result")

_CONNECT_S = 10.0


def do_all(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int,
    scheduler: str | None = None,
    prepare: Callable[[], None],
    computed_with: Callable[[], Mapping[str, str]],
) -> Generator[Result, None, None]:
    """Results in the order in which they are finished.

    Args:
        work: A function of a module.
        items: What to call it with.
        workers: Processes, when there is no scheduler.
        scheduler: Address of a Dask scheduler, as ``tcp://host:8786``; none: this machine.
        prepare: Called once here, or once on each worker of a cluster, before any work.
        computed_with: All that decides about the last bit of a result (:func:`computed_with`), called on
            workers of a cluster too: they must agree.

    Raises:
        ConfigError: when Dask is not installed, no scheduler answers, it has no workers, or they run
            other sources than these.
    """
    if scheduler is None:
        return _local(work, items, workers, prepare)
    return _cluster(work, items, scheduler, prepare, computed_with)


def _local(
    work: Callable[[Item], Result], items: Sequence[Item], workers: int, prepare: Callable[[], None]
) -> Generator[Result, None, None]:
    prepare()
    parallel = joblib.Parallel(n_jobs=workers, return_as="generator_unordered")
    results = parallel(joblib.delayed(work)(item) for item in items)
    with warnings.catch_warnings(), contextlib.closing(results):
        # When this is broken off, joblib would warn that work is lost. It is not: it is done next time.
        warnings.filterwarnings("ignore", ".*tasks which were still being processed")
        yield from results


def _cluster(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    scheduler: str,
    prepare: Callable[[], None],
    computed_with: Callable[[], Mapping[str, str]],
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
        check_workers(client, scheduler, computed_with)
        client.run(prepare)
        futures = client.map(work, items, pure=False)
        for batch in as_completed(futures, with_results=True).batches():
            for _, result in batch:
                yield result


def versions(names: Sequence[str]) -> dict[str, str]:
    """Versions of packages that results are computed with, by name."""
    return {name: importlib.metadata.version(name) for name in names}


def computed_with(module: str, names: Sequence[str]) -> dict[str, str]:
    """What decides about the last bit of what a module computes.

    Args:
        module: Where the work is defined: sources that it depends on count.
        names: Of packages whose versions count.
    """
    return {"sources": dependency_hash(module), "processor": processor(), **versions(names)}


def check_workers(
    client: Any, scheduler: str, computed_with: Callable[[], Mapping[str, str]]
) -> None:
    """Refuse workers that would run other code, or whose results round otherwise.

    Raises:
        ConfigError: naming the worker and the difference.
    """
    theirs = client.run(computed_with)
    if not theirs:
        raise ConfigError(f"the scheduler at {scheduler} has no workers")
    ours = computed_with()
    for name, found in sorted(theirs.items()):
        for what, value in ours.items():
            if found[what] != value:
                raise ConfigError(
                    f"worker {name} has {what} {found[what]}",
                    expected=f"{value}, as here",
                    hint="the same checkout, environment and kind of processor on all machines",
                )
