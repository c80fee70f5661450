"""Bags, altered as records, as metadata and as bytes."""

from __future__ import annotations

from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest
from fuzz_bytes import BYTES, TEXT, altered
from fuzz_mcaps import mcaps
from fuzz_run import LIMIT, fuzz
from fuzz_trees import trees, yaml_bytes
from hypothesis import strategies as st

pytestmark = LIMIT


@pytest.mark.parametrize("kind", fuzz_readers.BAGS)
def test_files(sandbox, tmp_path: Path, kind: str) -> None:
    files = fuzz_samples.bag_files()
    # Salvage gives up only what has neither a beginning nor a whole chunk.
    share = 0.01 if kind == "salvaged" else 0.1
    fuzz(sandbox, fuzz_readers.BAGS[kind], mcaps(files), tmp_path / "a.mcap", files, share)


@pytest.mark.parametrize("kind", ["arms", "predictions"])
def test_messages(sandbox, tmp_path: Path, kind: str) -> None:
    arm, prediction = fuzz_samples.arm_bag_files()
    files = ({"arms": arm, "predictions": prediction}[kind],)
    fuzz(sandbox, getattr(fuzz_readers, kind), mcaps(files), tmp_path / "a.mcap", files)


def test_metadata(sandbox, tmp_path: Path) -> None:
    values = fuzz_samples.metadata_trees()
    files = tuple(map(yaml_bytes, values))
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").write_bytes(fuzz_samples.bag_files()[0])
    contents = st.one_of(trees(values).map(yaml_bytes), altered(files, (*BYTES, *TEXT), 20_000))
    path = tmp_path / "bag" / "metadata.yaml"
    fuzz(sandbox, lambda file: fuzz_readers.any_bag(file.parent), contents, path, files)
