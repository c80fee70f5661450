"""Many altered files for one reader."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from fuzz_sandbox import Sandbox
from hypothesis import HealthCheck, given, seed, settings
from hypothesis.strategies import SearchStrategy

VARIABLE = "HRI_FUZZ_EXAMPLES"
TIMES = max(int(os.environ.get(VARIABLE) or 1), 1)
"""How many times as many files as in every test run."""
EXAMPLES = 60 * TIMES
SEED_VARIABLE = "HRI_FUZZ_SEED"
SEED = os.environ.get(SEED_VARIABLE) or ""
"""Other files than those of every run: a number for the same ones again; empty: those of every run."""
LIMIT = pytest.mark.timeout(300 * TIMES)
"""For the module of such tests [s]."""


def fuzz(
    make: Callable[..., Sandbox],
    read: Callable[[Path], object],
    contents: SearchStrategy[bytes],
    path: Path,
    samples: tuple[bytes, ...] = (),
    refused: float = 0.1,
) -> None:
    """Read files as they are, and altered: each is read, or refused by an error of ours that names it.

    Args:
        make: Makes the sandbox.
        read: Reader.
        contents: Altered files.
        path: Where each of them is put; its folder is made.
        samples: Files that the reader must take.
        refused: Share of the files of which the reader refuses more.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for sample in samples:
        path.write_bytes(sample)
        read(path)  # here, so that the sandbox finds everything loaded and compiled
    box = make(read)

    @settings(
        max_examples=EXAMPLES,
        derandomize=not SEED,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(contents)
    def each(content: bytes) -> None:
        path.write_bytes(content)
        box.check(path)

    (seed(int(SEED))(each) if SEED else each)()
    if not SEED:  # of others than those of every run, few may happen to be of one kind
        assert box.count["refused"] > EXAMPLES * refused
        assert box.count["read"] > EXAMPLES // 50
