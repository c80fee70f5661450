"""Settings in YAML, altered as values, as text and as bytes."""

from __future__ import annotations

from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest
from fuzz_bytes import BYTES, TEXT, altered
from fuzz_run import LIMIT, fuzz
from fuzz_trees import json_text, trees, yaml_bytes
from hypothesis import strategies as st

pytestmark = LIMIT
LONGEST = 20_000


@pytest.mark.parametrize("kind", fuzz_readers.SETTINGS)
def test_settings(sandbox, tmp_path: Path, kind: str) -> None:
    values = fuzz_samples.setting_trees()[kind]
    files = tuple(map(yaml_bytes, values))
    as_text = altered(files, (*BYTES, *TEXT), LONGEST)
    contents = st.one_of(trees(values).map(yaml_bytes), as_text)
    fuzz(sandbox, fuzz_readers.SETTINGS[kind], contents, tmp_path / "a.yaml", files)


@pytest.mark.parametrize("kind", fuzz_readers.PLAIN)
def test_plain_files(sandbox, tmp_path: Path, kind: str) -> None:
    values = fuzz_samples.plain_trees()[kind]
    files = tuple(map(_json, values))
    as_text = altered(files, (*BYTES, *TEXT), LONGEST)
    contents = st.one_of(trees(values).map(_json), as_text)
    path = tmp_path / "people" / "ann" / "person.json"
    fuzz(sandbox, fuzz_readers.PLAIN[kind], contents, path, files)


def _json(tree: object) -> bytes:
    return json_text(tree).encode("utf-8", "surrogatepass")
