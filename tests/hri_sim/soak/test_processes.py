"""What processes take, and what they leave behind."""

from __future__ import annotations

import os
import subprocess
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.soak.processes import (
    SHARED_MEMORY,
    left_behind,
    look_at,
    parse_status,
    shared_files,
    still_runs,
)
from hri_sim.soak.sampler import Sampler, check_disk

HOLDS = """
import mmap, os, sys
name = sys.argv[1]
file = open(name, "w+b")
file.truncate(4096)
kept = mmap.mmap(file.fileno(), 4096)
file.close()
ballast = bytearray(int(sys.argv[2]) * 1_000_000)
print("ready", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def shared() -> Iterator[Path]:
    path = SHARED_MEMORY / f"test_soak_{uuid.uuid4().hex}"
    yield path
    path.unlink(missing_ok=True)


@pytest.fixture
def holder(shared: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A process with 50 MB and a file of shared memory."""
    command = [sys.executable, "-c", HOLDS, str(shared), "50"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"ready\n"
        yield process
        process.kill()


def test_a_look_at_a_process(holder: subprocess.Popen[bytes], shared: Path) -> None:
    seen = look_at(holder.pid)
    assert seen is not None
    assert 50.0 < seen.memory_mb < 80.0
    assert seen.resident_mb > seen.memory_mb
    assert seen.threads == 1
    assert seen.files >= 3
    assert seen.cpu_s >= 0.0
    assert shared.name in shared_files(holder.pid)
    holder.kill()
    psutil.wait_procs([psutil.Process(holder.pid)], timeout=5.0)
    assert not still_runs(holder.pid, seen.born)
    assert look_at(holder.pid) is None
    assert shared_files(2**22 + 1) == set()


def test_memory_is_what_is_the_process_own() -> None:
    text = "Name:\tx\nVmRSS:\t  300 kB\nRssAnon:\t  200 kB\nRssFile:\t 100 kB\n"
    text += "VmSwap:\t 7 kB\nThreads:\t3\n"
    assert parse_status(text) == {"VmRSS": 300, "RssAnon": 200, "VmSwap": 7, "Threads": 3}


def test_samples_remember_what_must_be_gone(
    holder: subprocess.Popen[bytes], shared: Path, tmp_path: Path
) -> None:
    for name, size in (("bag", 1000), ("bag_2", 500), ("bag_10", 20), ("bag_old", 7)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x_0.mcap").write_bytes(bytes(size))
    sampler = Sampler(tmp_path / "bag")
    pids = {"node": holder.pid, "script": os.getpid(), "gone": 2**22 + 1}
    for _ in range(2):
        sample = sampler.take(pids)
    assert set(sample["processes"]) == {"node", "script"}
    assert list(sample["bags"].items()) == [("bag", 1000), ("bag_2", 500), ("bag_10", 20)]
    assert sample["shared_files"] >= 1
    assert sampler.orphans(os.getpid()) == [f"node ({holder.pid})"]
    assert shared.name in sampler.shared_left()
    holder.kill()
    holder.wait()
    shared.unlink()
    assert sampler.orphans(os.getpid()) == []
    assert shared.name not in left_behind({shared.name})


def test_a_disk_with_too_little_room(tmp_path: Path) -> None:
    assert check_disk(tmp_path / "not" / "yet", 0.0) > 0.0
    with pytest.raises(ConfigError, match="MB left"):
        check_disk(tmp_path / "not" / "yet", 1e12)
