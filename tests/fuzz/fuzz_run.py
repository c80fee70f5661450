"""Many altered files for one reader."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from fuzz_sandbox import Sandbox
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import SearchStrategy

VARIABLE = "HRI_FUZZ_EXAMPLES"
TIMES = max(int(os.environ.get(VARIABLE) or 1), 1)
"""How many times as many files as in every test run."""
EXAMPLES = 60 * TIMES
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
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(contents)
    def each(content: bytes) -> None:
        path.write_bytes(content)
        box.check(path)

    each()
    assert box.count["refused"] > EXAMPLES * refused
    assert box.count["read"] > EXAMPLES // 50
