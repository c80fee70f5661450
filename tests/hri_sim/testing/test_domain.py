"""Tests that run at the same time do not hear each other."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from hri_prediction.errors import GraphError
from hri_sim.faults import command
from hri_sim.ontology import evaluation_command
from hri_sim.testing import domain
from hri_sim.testing.domain import LAST, TAKEN, own_domain

CLAIM = "from hri_sim.testing.domain import own_domain; print(own_domain(), flush=True); input()"


def claim() -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", CLAIM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def said(process: subprocess.Popen[str]) -> int:
    assert process.stdout is not None
    return int(process.stdout.readline())


def test_each_process_and_each_purpose_has_its_own() -> None:
    mine = {own_domain(), own_domain("another")}
    assert len(mine) == 2
    assert own_domain() in mine  # and keeps it
    others = [claim() for _ in range(3)]
    try:
        theirs = [said(process) for process in others]
    finally:
        for process in others:
            process.kill()  # however they end, the domains are free again
            process.communicate()
    assert len(mine | set(theirs)) == 5
    assert all(0 < one <= LAST and one not in TAKEN for one in mine | set(theirs))


def test_domains_of_scripts_are_left_out() -> None:
    assert {int(command.DOMAIN), int(evaluation_command.DOMAIN)} == {*TAKEN}


def test_when_all_are_claimed_it_is_said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(domain, "_claimed", claimed := {})
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    try:
        for number in range(LAST - len(TAKEN)):
            own_domain(str(number))
        with pytest.raises(GraphError, match="ROS domains 1 to 100 are claimed"):
            own_domain("one more")
    finally:
        for _, lock in claimed.values():
            os.close(lock)
