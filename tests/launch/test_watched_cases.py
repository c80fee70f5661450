"""Two people who are watched live: what becomes of it when the monitor dies."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest

from hri_sim.launch import watch_cases
from hri_sim.launch.deaths import NodeDeath
from hri_sim.testing.domain import own_domain


def test_a_monitor_that_dies_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is waited for no longer, and what was to be measured is not left out without a word."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(own_domain("watched")))
    killing = SimpleNamespace(
        sched_getaffinity=os.sched_getaffinity,
        sched_setaffinity=lambda pid, _: os.kill(pid, signal.SIGKILL),
    )
    monkeypatch.setattr(watch_cases, "os", killing)
    with pytest.raises(NodeDeath, match="interaction_monitor was ended by SIGKILL"):
        watch_cases.listen_live(tmp_path, 1, 0, 1.0)
