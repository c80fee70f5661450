"""What a process takes of the machine, as the kernel counts it anyway.

Memory is the resident anonymous memory (``RssAnon``) with what of the process is swapped out: heaps,
stacks and arrays, in short what a leak makes grow. Resident memory as a whole holds shared libraries and
files besides, against which a leak would look smaller. What is private to a process (USS) would be nearly
the same, but is only had by a walk through all its pages, which may hold the process up.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import psutil

_FIELDS = re.compile(r"^(VmRSS|RssAnon|VmSwap|Threads):\s+(\d+)", re.MULTILINE)
SHARED_MEMORY = Path("/dev/shm")
KEPT = ("lttng-ust-wait",)
"""Begins of names of files that a library keeps there for all processes of a user."""
_MAPPED = re.compile(rf"{SHARED_MEMORY}/(\S+)")


@dataclass(frozen=True)
class ProcessSample:
    """One look at a process.

    Attributes:
        pid: Its number.
        born: When it was started, in seconds of the system clock; with the number it is unique.
        memory_mb: Resident anonymous memory, and what of it is swapped out [MB].
        resident_mb: All resident memory [MB].
        threads: Its threads.
        files: Its open files.
        cpu_s: Processor time since it was started [s].
    """

    pid: int
    born: float
    memory_mb: float
    resident_mb: float
    threads: int
    files: int
    cpu_s: float

    def to_mapping(self) -> dict[str, Any]:
        """As a record has it."""
        return asdict(self)


def parse_status(text: str) -> dict[str, int]:
    """The figures of a ``/proc/<pid>/status`` that matter, memory in kB."""
    return {name: int(value) for name, value in _FIELDS.findall(text)}


def look_at(pid: int) -> ProcessSample | None:
    """A look at a process; none when it has ended."""
    try:
        process = psutil.Process(pid)
        with process.oneshot():
            fields = parse_status(Path(f"/proc/{pid}/status").read_text())
            if "RssAnon" not in fields:
                return None  # it has ended, and nobody has asked yet how
            times = process.cpu_times()
            return ProcessSample(
                pid=pid,
                born=process.create_time(),
                memory_mb=round((fields["RssAnon"] + fields.get("VmSwap", 0)) / 1e3, 3),
                resident_mb=round(fields["VmRSS"] / 1e3, 3),
                threads=fields["Threads"],
                files=process.num_fds(),
                cpu_s=round(times.user + times.system, 2),
            )
    except (psutil.Error, OSError):
        return None


def still_runs(pid: int, born: float) -> bool:
    """Whether the process that was started then still runs."""
    try:
        process = psutil.Process(pid)
        return process.create_time() == born and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


def shared_files(pid: int) -> set[str]:
    """Names of the files of shared memory that a process has mapped and should remove."""
    try:
        names = _MAPPED.findall(Path(f"/proc/{pid}/maps").read_text())
    except OSError:
        return set()
    return {name for name in names if not name.startswith(KEPT)}


def left_behind(names: set[str]) -> list[str]:
    """Those of some files of shared memory that are still there."""
    return sorted(name for name in names if (SHARED_MEMORY / name).exists())
