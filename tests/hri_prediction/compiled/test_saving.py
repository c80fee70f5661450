"""Compiled kernels are saved by one process at a time."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
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


def test_it_is_known_whether_anything_is_compiled(tmp_path: Path) -> None:
    code = (
        "import numpy as np, hri_prediction.warm as w, hri_prediction.compiled as c; "
        "from hri_prediction.tracks.speed import regression_speed as speed; "
        "print(c.has_cache()); speed(np.arange(5.0), np.zeros((5, 3))); print(c.has_cache())"
    )
    env = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    assert done.stdout.split() == ["False", "True"], done.stderr
