"""Which commit of a checkout is at work, as git tells."""

from __future__ import annotations

import subprocess
from pathlib import Path


def git_revision(folder: Path) -> str:
    """Revision of the checkout that holds a folder, ``-dirty`` if changed; empty if none."""
    return _git(folder, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def describe_commit(root: Path) -> str:
    """Name of a checkout's commit, from the last tag on, ``-dirty`` if code was changed; or empty.

    Args:
        root: Top folder of the checkout; empty is returned for any other.
    """
    if not (root / ".git").exists():  # an unpacked archive, perhaps inside somebody's repository
        return ""
    name = _git(root, "describe", "--always", "--tags", "--abbrev=12")
    changed = _git(root, "status", "--porcelain", "--", "ros_ws", "scripts", "requirements")
    return f"{name}-dirty" if name and changed else name


def _git(folder: Path, *arguments: str) -> str:
    """What git answers; empty when it fails or is not there."""
    try:
        found = subprocess.run(
            ["git", *arguments],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=5.0,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
