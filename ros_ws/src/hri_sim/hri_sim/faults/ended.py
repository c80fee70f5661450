"""Programs that are given something damaged, and have to end by themselves."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

SECONDS = 60.0
"""So long may they take [s]."""


def ended(
    command: Sequence[str | Path], environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str] | None:
    """What a program has said, and its exit code; none when it did not end in time, and was killed.

    Args:
        command: The program and its arguments; it is asked nothing.
        environment: Its environment; none: this one's.
    """
    try:
        return subprocess.run(
            [str(word) for word in command],
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
