"""What a file with results says of where they come from: commit, date, machine."""

from __future__ import annotations

import os
import platform
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hri_prediction.results.commit import describe_commit

UNKNOWN = "unknown"


def available_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def results_origin() -> dict[str, Any]:
    """Commit (``git describe``), date and machine; to be asked for before anything is measured.

    The commit is that of the checkout whose scripts were started; outside a repository it is
    ``unknown``.
    """
    root = os.environ.get("HRI_PROJECT_ROOT")
    return {
        "commit": (describe_commit(Path(root)) if root else "") or UNKNOWN,
        "date": datetime.now(UTC).date().isoformat(),
        "machine": {
            "cpu": cpu_model(),
            "cores": available_cores(),
            "python": platform.python_version(),
            "socket_bytes": _socket_bytes(),
        },
    }


def origin_line(origin: dict[str, Any]) -> str:
    """The same as a line of a report."""
    machine = origin["machine"]
    return (
        f"Commit {origin['commit']}, {origin['date']}; {machine['cpu']}, "
        f"{machine['cores']} cores, Python {machine['python']}."
    )


def cpu_model(info: Path = Path("/proc/cpuinfo")) -> str:
    """Name of the processor as the kernel tells it, or at least its architecture."""
    try:
        lines = info.read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next((name for name in names if name), platform.machine() or UNKNOWN)


def socket_line(origin: dict[str, Any]) -> str:
    """What decides how long a held-up process loses nothing, as a line of a report."""
    size = origin["machine"].get("socket_bytes")
    held = "an unknown size" if size is None else f"{size / 1e6:.1f} MB"
    return f"Buffers of sockets are of {held} at most (net.core.rmem_max)."


def _socket_bytes() -> int | None:
    try:
        return int(Path("/proc/sys/net/core/rmem_max").read_text())
    except (OSError, ValueError):
        return None
