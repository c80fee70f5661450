"""Real-time priority where it is permitted, and going on as before where it is not."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from hri_prediction.ros import scheduling
from hri_prediction.ros.scheduling import SHARED, take_precedence

ASK = (
    "import os, threading, time\n"
    "from hri_prediction.ros.scheduling import take_precedence\n"
    "wait = threading.Event()\n"
    "threading.Thread(target=wait.wait).start()\n"  # one that runs already
    "said = take_precedence(7)\n"
    "threading.Thread(target=wait.wait).start()\n"  # and one that begins later
    "tasks = [int(task) for task in os.listdir('/proc/self/task')]\n"
    "print(said, sorted({os.sched_getscheduler(task) == os.SCHED_FIFO for task in tasks}), len(tasks))\n"
    "wait.set()\n"
)


def _permitted() -> bool:
    code = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))"
    return subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def test_all_threads_have_it() -> None:
    if not _permitted() or len(os.sched_getaffinity(0)) < 2:
        pytest.skip("real-time priority is not permitted here, or there is one processor")
    found = subprocess.run([sys.executable, "-c", ASK], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["SCHED_FIFO", "7", "[True]", "3"]


def test_none_is_asked_for() -> None:
    assert take_precedence(0) == SHARED
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_where_it_is_not_permitted_all_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: object) -> None:
        raise PermissionError

    monkeypatch.setattr(scheduling, "available_cores", lambda: 2)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    said = "shared: real-time priority 7 is not permitted (ulimit -r is below 12)"
    assert take_precedence(7) == said


def test_one_processor_is_not_taken_from_all_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scheduling, "available_cores", lambda: 1)
    assert take_precedence(7) == "shared: real-time priority 7 needs more than one processor"


def test_a_thread_that_has_just_ended_is_no_trouble(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def gone(task: int, *given: object) -> None:
        asked.append(task)
        if task:
            raise ProcessLookupError

    monkeypatch.setattr(scheduling, "available_cores", lambda: 2)
    monkeypatch.setattr(os, "sched_setscheduler", gone)
    assert take_precedence(7) == SHARED
    assert len(asked) > 1


def test_what_fails_otherwise_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*given: object) -> None:
        raise OSError("no such thing")

    monkeypatch.setattr(scheduling, "available_cores", lambda: 2)
    monkeypatch.setattr(os, "sched_setscheduler", fail)
    assert take_precedence(7) == "shared: real-time priority 7 failed (no such thing)"


def test_none_has_any_where_the_highest_is_not_permitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else people of the simulation would come before the separation monitor."""

    def limited(task: int, policy: int, wanted: os.sched_param) -> None:
        if wanted.sched_priority > 10:
            raise PermissionError

    monkeypatch.setattr(scheduling, "available_cores", lambda: 2)
    monkeypatch.setattr(os, "sched_setscheduler", limited)
    assert "not permitted" in take_precedence(10)


def test_what_was_inherited_is_given_back_and_told() -> None:
    if not _permitted():
        pytest.skip("real-time priority is not permitted here")
    code = (
        "import os\n"
        "from hri_prediction.ros.scheduling import share_processors, take_precedence\n"
        "os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(3))\n"
        "print(take_precedence(0))\n"
        "share_processors()\n"
        "print(take_precedence(0))\n"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines() == ["SCHED_RR 3", SHARED]
