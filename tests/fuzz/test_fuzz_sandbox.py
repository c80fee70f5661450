"""The sandbox itself: whatever a reader does to it is told, and it goes on."""

from __future__ import annotations

import ctypes
import os
import pickle
import time
from pathlib import Path

import pytest
from fuzz_archives import Canary
from fuzz_sandbox import CANARY, LONGEST_TEXT

from hri_prediction.errors import DataError


def behaves(path: Path) -> None:
    """As the file tells it to."""
    what = path.read_bytes()
    if what == b"crash":
        ctypes.string_at(0)
    elif what == b"hang":
        time.sleep(60.0)
    elif what == b"end":
        os._exit(3)
    elif what == b"swell":
        bytearray(1 << 30)
    elif what == b"swell and be quiet":
        try:
            bytearray(1 << 30)
        except MemoryError as error:
            raise DataError(f"{path} is too large") from error
    elif what == b"error":
        raise KeyError("x")
    elif what == b"refuse":
        raise DataError(f"{path} is none")
    elif what == b"refuse what":
        raise DataError("it is none")
    elif what == b"talk":
        raise DataError(f"{path} is {'x' * LONGEST_TEXT}")
    elif what.startswith(b"\x80"):
        pickle.loads(what)


FAULTS = {
    b"crash": "SIGSEGV",
    b"hang": "code 1",
    b"end": "code 3",
    b"swell": "MemoryError",
    b"swell and be quiet": "asked for more memory",
    b"error": "KeyError",
    pickle.dumps(Canary(CANARY)): "had something executed",
}


def test_faults_are_told(sandbox, tmp_path: Path) -> None:
    path = tmp_path / "file"
    box = sandbox(behaves, seconds=1.0)
    for what, text in FAULTS.items():
        path.write_bytes(what)
        found = box.verdict(path)
        assert (found.kind, text in found.text) == ("fault", True), (what, found)
        with pytest.raises(AssertionError, match="file"):
            box.check(path)
        path.write_bytes(b"nothing")
        assert box.check(path).kind == "read"
    assert box.count == {"read": len(FAULTS), "refused": 0, "fault": 2 * len(FAULTS)}


def test_refusals_name_the_file_and_are_short(sandbox, tmp_path: Path) -> None:
    path = tmp_path / "file"
    box = sandbox(behaves)
    path.write_bytes(b"refuse")
    assert box.check(path).kind == "refused"
    for what, text in ((b"refuse what", "is not named"), (b"talk", "characters")):
        path.write_bytes(what)
        with pytest.raises(AssertionError, match=text):
            box.check(path)
