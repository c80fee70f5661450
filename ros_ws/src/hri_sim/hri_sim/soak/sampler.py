"""Looks at the processes and files of a run, once a second."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hri_prediction.errors import ConfigError
from hri_sim.recording.folders import bag_folders
from hri_sim.soak.ending import bag_bytes
from hri_sim.soak.processes import left_behind, look_at, shared_files, still_runs


class Sampler:
    """Makes the samples of a run, and remembers what must be gone after it.

    Args:
        bag: First bag folder.
    """

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._seen: dict[tuple[int, float], str] = {}
        self._shared: set[str] = set()
        self._taken = 0

    def take(self, pids: Mapping[str, int]) -> dict[str, Any]:
        """A sample.

        Args:
            pids: Processes by name.
        """
        processes = {}
        for label, pid in pids.items():
            sample = look_at(pid)
            if sample is None:
                continue
            processes[label] = sample.to_mapping()
            self._seen[pid, sample.born] = label
        if processes:
            # One each time: the list of what a process has mapped takes some milliseconds.
            looked_at = list(processes)[self._taken % len(processes)]
            self._shared |= shared_files(pids[looked_at])
        self._taken += 1
        folders = bag_folders(self._bag)
        disk = folders[-1] if folders else self._bag.parent
        return {
            "processes": processes,
            "bags": {folder.name: bag_bytes(folder) for folder in folders},
            "shared_files": len(self._shared),
            "free_mb": round(shutil.disk_usage(disk).free / 1e6),
        }

    def orphans(self, own: int) -> list[str]:
        """Processes of the run that still run, but for the script's own."""
        return sorted(
            f"{label} ({pid})"
            for (pid, born), label in self._seen.items()
            if pid != own and still_runs(pid, born)
        )

    def shared_left(self) -> list[str]:
        """Files of shared memory that processes of the run had mapped, and that are still there."""
        return left_behind(self._shared)


def check_disk(folder: Path, needed_mb: float) -> float:
    """Free space where a folder is, or is to be [MB].

    Raises:
        ConfigError: when it is less than needed.
    """
    there = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    free_mb = shutil.disk_usage(there).free / 1e6
    if free_mb < needed_mb:
        raise ConfigError(
            f"{there} has {free_mb:.0f} MB left",
            expected=f"{needed_mb:.0f} MB for the recording of so long a run",
            hint="choose fewer --minutes, or an --out on another disk",
        )
    return free_mb
