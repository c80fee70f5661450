"""Models, policies and sessions on disk, altered in any way."""

from __future__ import annotations

from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest
from fuzz_archives import archives
from fuzz_run import LIMIT, fuzz
from fuzz_sandbox import CANARY

pytestmark = LIMIT


@pytest.mark.parametrize("kind", fuzz_readers.MODELS)
def test_models(sandbox, tmp_path: Path, kind: str) -> None:
    files = fuzz_samples.model_files()[kind]
    contents = archives(files, CANARY)
    path = tmp_path / ("session.npz" if kind == "session" else "a.npz")
    fuzz(sandbox, fuzz_readers.MODELS[kind], contents, path, files)


def test_library_of_policies(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.model_files()["dmp"]
    contents = archives(files, CANARY)
    path = tmp_path / "library" / "transfer" / "ann.npz"
    fuzz(sandbox, fuzz_readers.library_of, contents, path, files)


def test_policies_of_any_kind(sandbox, tmp_path: Path) -> None:
    files = (*fuzz_samples.model_files()["dmp"], *fuzz_samples.model_files()["rnn"])
    contents = archives(files, CANARY)
    fuzz(sandbox, fuzz_readers.load_any, contents, tmp_path / "a.npz", files)
