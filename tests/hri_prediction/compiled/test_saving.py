"""Compiled kernels are saved by one process at a time."""

from __future__ import annotations

import fcntl
import threading
from pathlib import Path

from numba.core.caching import IndexDataCacheFile

import hri_prediction.compiled  # noqa: F401  (has them saved in turn)


def test_who_saves_waits_for_the_other(tmp_path: Path) -> None:
    file = IndexDataCacheFile(str(tmp_path), "kernel", "stamp")
    with (tmp_path / "lock").open("a") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        saving = threading.Thread(target=file.save, args=("double", 1))
        saving.start()
        saving.join(0.2)
        assert saving.is_alive()
        assert file.load("double") is None
    saving.join(5.0)
    file.save("single", 2)
    assert (file.load("double"), file.load("single")) == (1, 2)
