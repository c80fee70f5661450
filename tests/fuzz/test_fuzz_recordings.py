"""Recordings of people, altered in any way: importers, track files, labels, handovers."""

from __future__ import annotations

from pathlib import Path

import fuzz_readers
import fuzz_samples
import pytest
from fuzz_archives import archives
from fuzz_bytes import BYTES, TEXT, altered
from fuzz_c3ds import c3ds
from fuzz_run import LIMIT, fuzz
from fuzz_sandbox import CANARY

pytestmark = LIMIT
AS_TEXT = (*BYTES, *TEXT, *TEXT)


@pytest.mark.parametrize("ending", ["trc", "bvh", "csv", "tsv"])
def test_texts_of_motion_capture_programs(sandbox, tmp_path: Path, ending: str) -> None:
    files = fuzz_samples.marker_files()[ending]
    fuzz(sandbox, fuzz_readers.markers, altered(files, AS_TEXT), tmp_path / f"a.{ending}", files)


def test_c3d(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.marker_files()["c3d"]
    fuzz(sandbox, fuzz_readers.markers, c3ds(files), tmp_path / "a.c3d", files)


def test_track_archives(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.track_archives()
    contents = archives(files, CANARY)
    fuzz(sandbox, fuzz_readers.tracks, contents, tmp_path / "a.npz", files)


def test_track_texts(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.track_texts()
    fuzz(sandbox, fuzz_readers.tracks, altered(files, AS_TEXT), tmp_path / "a.csv", files)


def test_handovers(sandbox, tmp_path: Path) -> None:
    files = fuzz_samples.handover_archives()
    contents = archives(files, CANARY)
    fuzz(sandbox, fuzz_readers.load_handovers, contents, tmp_path / "hands.npz", files)
