"""ROS domains that no other test has: two that hear each other are neither repeatable nor right."""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path

from hri_prediction.errors import GraphError

LAST = 100
"""Ports of higher domains may collide with ephemeral ones."""
TAKEN = (76, 77)
"""Domains that scripts take by themselves."""

_claimed: dict[str, tuple[int, int]] = {}  # domain and lock, which ends with the process


def own_domain(purpose: str = "") -> int:
    """A domain that no other process gets as long as this one lives.

    It is claimed by a lock on a file in the folder of temporary files, which the system takes back however
    the process ends.

    Args:
        purpose: Others of the same process get others.

    Raises:
        GraphError: when all are claimed.
    """
    if purpose in _claimed:
        return _claimed[purpose][0]
    for count in range(LAST):
        domain = 1 + (os.getpid() + count) % LAST
        if domain in TAKEN:
            continue
        path = Path(tempfile.gettempdir()) / f"hri_domain_{domain}.lock"
        try:
            lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        except OSError:
            continue  # another user's
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            continue
        _claimed[purpose] = domain, lock
        return domain
    raise GraphError(
        f"all of the ROS domains 1 to {LAST} are claimed by tests that run",
        expected="a free one",
        hint="end some of them, or give domain_id",
    )
