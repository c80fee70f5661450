"""Makes this folder's helper modules, and the motion capture files of the importers' tests, importable."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "hri_prediction" / "importers")]

from fuzz_sandbox import Sandbox  # noqa: E402  (after the path is known)


@pytest.fixture
def sandbox(tmp_path: Path) -> Iterator[Callable[..., Sandbox]]:
    """Makes sandboxes, whose processes end with the test."""
    made: list[Sandbox] = []

    def make(read: Callable[[Path], object], **limits: float) -> Sandbox:
        made.append(Sandbox(read, tmp_path / f"sandbox_{len(made)}", **limits))
        return made[-1]

    yield make
    for one in made:
        one.close()
