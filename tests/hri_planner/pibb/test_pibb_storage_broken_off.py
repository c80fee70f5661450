"""No kill and no full disk leaves half of a session."""

import csv
import os
import random
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sessions import PERSON, advanced, begun, known

from hri_planner.dmp.model_file import read_dmp
from hri_planner.pibb import storage
from hri_planner.pibb.storage import (
    POLICY,
    SESSION,
    TRIALS,
    load_session,
    save_session,
)
from hri_prediction.errors import DataError, HriError
from hri_prediction.files import whole
from hri_prediction.files.whole import write_whole


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


class Killed(BaseException):
    """Nothing catches it, as nothing runs after a kill."""


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), Killed()])
@pytest.mark.parametrize("what", ["write_npz", "save_dmp", "_write_rows", "_sync", "os.replace"])
def test_what_was_there_survives_a_save_that_fails(
    saved: Path, monkeypatch: pytest.MonkeyPatch, what: str, error: BaseException
) -> None:
    before = contents(saved)

    def fail(path: Path, *rest: Any) -> None:
        if what != "os.replace":
            Path(path).write_bytes(b"half of i")
        raise error

    where = {"os.replace": os, "_sync": whole}.get(what, storage)
    monkeypatch.setattr(where, what.removeprefix("os."), fail)
    with pytest.raises(HriError if isinstance(error, OSError) else Killed) as caught:
        save_session(saved, advanced(24), **PERSON)
    if isinstance(error, OSError):
        assert "No space left on device" in str(caught.value)
        assert "still there" in str(caught.value)
        assert "\n" not in str(caught.value)
    assert contents(saved) == before


@pytest.mark.parametrize("moved", [0, 1, 2])
def test_a_kill_between_two_files_leaves_a_whole_session(
    saved: Path, monkeypatch: pytest.MonkeyPatch, moved: int
) -> None:
    now = advanced(24)
    put, done = os.replace, []

    def some(source: Path, target: Path) -> None:
        if len(done) == moved:
            raise Killed
        done.append(target)
        put(source, target)

    monkeypatch.setattr(os, "replace", some)
    with pytest.raises(Killed):
        save_session(saved, now, **PERSON)
    monkeypatch.undo()
    # The session comes last: what is beside it is never older.
    assert known(load_session(saved)[0]) == known(advanced(23))
    read_dmp(saved / POLICY)
    save_session(saved, now, **PERSON)
    assert known(load_session(saved)[0]) == known(now)
    assert sorted(contents(saved)) == sorted([SESSION, TRIALS, POLICY])


def test_files_are_on_the_disk_before_they_take_their_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    sync, put = os.fsync, os.replace

    def synced(opened: int) -> None:
        done.append("sync " + Path(os.readlink(f"/proc/self/fd/{opened}")).name)
        sync(opened)

    def replaced(source: Path, target: Path) -> None:
        done.append(f"put {target.name}")
        put(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    save_session(tmp_path, begun(), **PERSON)
    assert done == [
        "sync .trials.part.csv",
        "sync .policy.part.npz",
        "sync .session.part.npz",
        f"put {TRIALS}",
        f"put {POLICY}",
        f"put {SESSION}",
        f"sync {tmp_path.name}",
    ]


@pytest.mark.parametrize("room", [100, 1500, 3000])
def test_a_disk_that_is_full(saved: Path, room: int) -> None:
    before = contents(saved)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(HriError, match=r"cannot write .*still there"):
            save_session(saved, advanced(24), **PERSON)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert contents(saved) == before


def test_folders_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(HriError, match=r"cannot write .*file"):
        save_session(tmp_path / "file", begun(), **PERSON)
    with pytest.raises(HriError, match="cannot write"):
        save_session(Path("/proc/nowhere"), begun(), **PERSON)


def test_processes_that_are_killed_leave_whole_files(tmp_path: Path) -> None:
    sessions = [advanced(trials) for trials in (18, 23)]
    wanted = [known(session) for session in sessions]
    save_session(tmp_path, sessions[0], **PERSON)
    pause = random.Random(5)
    for _ in range(15):
        before = (tmp_path / SESSION).stat().st_mtime_ns
        child = os.fork()
        if not child:
            try:
                while True:
                    for session in sessions:
                        save_session(tmp_path, session, **PERSON)
            finally:
                os._exit(1)
        end = time.monotonic() + 30.0
        while (tmp_path / SESSION).stat().st_mtime_ns == before and time.monotonic() < end:
            time.sleep(0.001)
        time.sleep(pause.uniform(0.0, 0.03))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        assert (tmp_path / SESSION).stat().st_mtime_ns != before
        assert known(load_session(tmp_path)[0]) in wanted
        read_dmp(tmp_path / POLICY)
        with (tmp_path / TRIALS).open(newline="") as file:
            assert len(list(csv.DictReader(file))) in (18, 23)


def test_what_a_kill_left_is_in_nobodys_way(saved: Path) -> None:
    (saved / ".session.part.npz").write_bytes(b"half")
    load_session(saved)
    save_session(saved, advanced(24), **PERSON)
    assert sorted(contents(saved)) == sorted([SESSION, TRIALS, POLICY])


def test_other_generators_are_refused_before_anything_is_written(saved: Path) -> None:
    before = contents(saved)
    session = advanced(8)
    session.state = replace(
        session.state, rng=dict(np.random.Generator(np.random.MT19937(0)).bit_generator.state)
    )
    with pytest.raises(DataError, match="PCG64"):
        save_session(saved, session, **PERSON)
    assert contents(saved) == before


def test_whole_files_come_in_their_order(tmp_path: Path) -> None:
    def writer(text: str) -> Callable[[Path], object]:
        return lambda path: path.write_text(text)

    write_whole({tmp_path / name: writer(name) for name in ("b.txt", "a.txt")})
    assert {name: text.decode() for name, text in contents(tmp_path).items()} == {
        "a.txt": "a.txt",
        "b.txt": "b.txt",
    }
