"""Simulations done by many: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from typing import TypeVar

from hri_prediction.results import workers as many

Item = TypeVar("Item")
Result = TypeVar("Result")

WORK = "hri_sim.benchmark.run"
"""The module that outcomes come from: what it depends on decides about them."""
_PACKAGES = ("numpy", "scipy", "numba", "mujoco")


@functools.cache
def compile_kernels() -> None:
    """Fill the cache of compiled kernels, in a process of its own, once.

    Code that has just been compiled rounds otherwise in the last bit than the same code read from the
    cache (fused operations, other inlining); processes that find the cache filled all round alike.
    """
    code = "from hri_sim.warm import fill_cache; fill_cache()"
    subprocess.run([sys.executable, "-c", code], check=True)


def do_all(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: int,
    scheduler: str | None = None,
) -> Generator[Result, None, None]:
    """Results in the order in which they are finished (:func:`hri_prediction.results.workers.do_all`)."""
    return many.do_all(
        work,
        items,
        workers=workers,
        scheduler=scheduler,
        prepare=compile_kernels,
        computed_with=_computed_with,
    )


def versions() -> dict[str, str]:
    """Versions of what outcomes are computed with, by package."""
    return many.versions(_PACKAGES)


def _computed_with() -> dict[str, str]:
    return many.computed_with(WORK, _PACKAGES)
