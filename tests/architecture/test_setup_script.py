"""Set-up: what it says when something is missing, and that it goes on where it stopped.

Nothing is installed here: the programs that it starts are replaced.
"""

from __future__ import annotations

import fcntl
import importlib.util
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
NO_NETWORK = """\
WARNING: Retrying (Retry(total=0, connect=None, read=None)) after connection broken by \
'NewConnectionError('<pip._vendor.urllib3.connection.HTTPSConnection object at 0x7f>: Failed to \
establish a new connection: [Errno -3] Temporary failure in name resolution')': /simple/numba/
ERROR: Could not find a version that satisfies the requirement numba==0.68.1 (from versions: none)
ERROR: No matching distribution found for numba==0.68.1
"""
NOT_OFFERED = """\
ERROR: Could not find a version that satisfies the requirement numba==0.68.1 (from versions: 0.60.0)
ERROR: No matching distribution found for numba==0.68.1
"""


@pytest.fixture
def setup(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """scripts/_setup.py, working on an empty project in a temporary folder."""
    spec = importlib.util.spec_from_file_location("hri_setup", ROOT / "scripts" / "_setup.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sources = tmp_path / "ros_ws" / "src"
    for package in ("hri_msgs", *module.PYTHON_PACKAGES):
        (sources / package).mkdir(parents=True)
        (sources / package / "package.xml").write_text(package)
    (tmp_path / "requirements").mkdir()
    for name in ("runtime.txt", "runtime_system_ros.txt", "dev.txt"):
        (tmp_path / "requirements" / name).write_text("numba==0.68.1\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "VENV", tmp_path / ".venv")
    monkeypatch.setattr(module, "STAMPS", tmp_path / ".venv" / ".setup.json")
    monkeypatch.setattr(module, "SOURCES", sources)
    monkeypatch.setattr(module, "REQUIREMENTS", tmp_path / "requirements")
    monkeypatch.setattr(module, "check_compiler", lambda: None)
    monkeypatch.setattr(sys, "argv", ["setup"])
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    return module


class Programs:
    """Stands in for what set-up starts; ``failing`` maps a word of a command to an outcome."""

    def __init__(self, module: ModuleType) -> None:
        self.started: list[str] = []
        self.failing: dict[str, str | BaseException] = {}
        self._module = module

    def run(self, command: list[str], **options) -> subprocess.CompletedProcess:
        text = " ".join(command)
        kind = next(
            word
            for word in ("-m venv", "pip --version", "pip install", "build", "fill_cache", "")
            if word in text
        )
        self.started.append(kind)
        outcome = self.failing.get(kind)
        if isinstance(outcome, BaseException):
            raise outcome
        if outcome is not None:
            stream = options.get("stdout")
            if hasattr(stream, "write"):
                stream.write(outcome.encode())
                stream.flush()
            return subprocess.CompletedProcess(command, 1, outcome, outcome)
        if kind == "-m venv":
            python = self._module.VENV / "bin" / "python"
            python.parent.mkdir(parents=True)
            python.write_text("")
        return subprocess.CompletedProcess(command, 0, "", "")

    def take(self) -> list[str]:
        """What was started since the last call."""
        started, self.started = self.started, []
        return started


@pytest.fixture
def programs(setup: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Programs:
    found = Programs(setup)
    monkeypatch.setattr(setup.subprocess, "run", found.run)
    monkeypatch.setattr(setup.shutil, "which", lambda name, path=None: f"/usr/bin/{name}")
    return found


def _one_line(text: str) -> str:
    """The last line; before it only progress."""
    *progress, last = text.strip().splitlines()
    assert all(line.startswith("setup: ") for line in [*progress, last])
    return last


# ------------------------------------------------------------------ what is missing
def test_wrong_python(tmp_path: Path) -> None:
    python = tmp_path / "python3.9"
    python.write_text('#!/bin/sh\n[ "$1" = --version ] && echo "Python 3.9.1" && exit 0\nexit 1\n')
    python.chmod(0o755)
    done = subprocess.run(
        [str(ROOT / "scripts" / "setup")],
        env={**os.environ, "HRI_PYTHON": str(python)},
        capture_output=True,
        text=True,
        timeout=30,
    )
    assert done.returncode == 1
    line = _one_line(done.stderr)
    assert "needs Python 3.11 or 3.12" in line
    assert "found: Python 3.9.1" in line


@pytest.mark.parametrize("made", [True, False])
def test_the_python_of_an_environment_is_kept(tmp_path: Path, made: bool) -> None:
    """Another one would make it anew. Where there is none yet, the system's own comes before others."""
    scripts = tmp_path / "scripts"
    scripts.mkdir()
    setup = scripts / "setup"
    setup.write_text((ROOT / "scripts" / "setup").read_text())
    setup.chmod(0o755)
    (scripts / "_setup.py").write_text("import sys; print(sys.executable)")
    here, other = tmp_path / "a home", tmp_path / "other"
    for folder in (here, other):
        folder.mkdir()
        python = folder / "python3"
        shown = f'#!/bin/sh\n[ "$2" = --help ] && echo "{folder}" && exit 0\n'
        python.write_text(f'{shown}exec "{sys.executable}" "$@"\n')
        python.chmod(0o755)
    if made:
        (tmp_path / ".venv").mkdir()
        (tmp_path / ".venv" / "pyvenv.cfg").write_text(f"home = {here}\nversion = 3.11.2\n")

    def taken(**more: str) -> str:
        env = {**os.environ, "PATH": f"{other}:{os.environ['PATH']}", **more}
        env = {name: value for name, value in env.items() if value and name != "ROS_DISTRO"}
        done = subprocess.run([str(setup), "--help"], env=env, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    assert taken(HRI_PYTHON=str(other / "python3")) == str(other)
    # Here, the system's own may be missing, of another version, or without headers.
    wanted = {str(here)} if made else {"/usr/bin/python3", str(other)}
    assert taken(HRI_PYTHON="") in wanted


def test_missing_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("hri_setup", ROOT / "scripts" / "_setup.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(module.SetupError, match=r"compiler.*not found; run: .*build-essential"):
        module.check_compiler()


def test_a_missing_compiler_ends_set_up_with_one_line(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    def missing() -> None:
        raise setup.SetupError("a C compiler not found; run: sudo apt-get install build-essential")

    monkeypatch.setattr(setup, "check_compiler", missing)
    assert setup.main() == 1
    assert "build-essential" in _one_line(capsys.readouterr().err)
    monkeypatch.setattr(setup, "check_compiler", lambda: None)
    programs.take()
    assert setup.main() == 0
    assert "pip install" not in programs.take()  # went on where it stopped


@pytest.mark.parametrize(
    ("output", "words"),
    [
        (NO_NETWORK, "no network"),
        (NOT_OFFERED, "does not offer a locked version"),
        ("ERROR: [Errno 28] No space left on device\n", "disk is full"),
        ("noise\nERROR: something new\nmore noise\n", "ERROR: something new"),
        ("", "installing runtime.txt failed"),
    ],
    ids=["no network", "version not offered", "disk full", "unknown error", "silent"],
)
def test_pip_fails(setup: ModuleType, programs: Programs, output: str, words: str, capsys) -> None:
    programs.failing["pip install"] = output
    assert setup.main() == 1
    assert words in _one_line(capsys.readouterr().err)
    programs.failing.clear()
    assert setup.main() == 0


def test_venv_module_is_missing(setup: ModuleType, programs: Programs, capsys) -> None:
    programs.failing["-m venv"] = "ensurepip is not available\n"
    assert setup.main() == 1
    assert "-venv" in _one_line(capsys.readouterr().err)
    assert not setup.VENV.exists()


def test_disk_trouble_is_one_line(setup: ModuleType, programs: Programs, capsys) -> None:
    programs.failing["-m venv"] = OSError(30, "Read-only file system", "/nowhere")
    assert setup.main() == 1
    assert _one_line(capsys.readouterr().err).endswith("Read-only file system: /nowhere")


# ------------------------------------------------------------------ going on
def test_second_run_does_nothing(setup: ModuleType, programs: Programs, capsys) -> None:
    assert setup.main() == 0
    assert programs.take() == ["-m venv", "pip install", "build", "fill_cache"]
    assert "ready after" in capsys.readouterr().err
    assert setup.main() == 0
    assert programs.take() == ["pip --version"]
    assert capsys.readouterr().err == ""


def _wait_for(text: str, seen: Callable[[], str], timeout_s: float = 5.0) -> None:
    end = time.monotonic() + timeout_s
    while text not in seen():
        assert time.monotonic() < end, seen()
        time.sleep(0.01)


def test_waits_for_a_running_graph_before_it_replaces_packages(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup.main()
    programs.take()
    said: list[str] = []
    monkeypatch.setattr(setup, "say", said.append)
    with (setup.ROOT / ".run.lock").open("a") as graph:
        fcntl.flock(graph, fcntl.LOCK_SH)
        assert setup.main() == 0  # nothing to replace: no need to wait
        assert said == []
        (setup.SOURCES / "hri_planner" / "new.py").write_text("x = 1\n")
        programs.take()
        codes: list[int] = []
        thread = threading.Thread(target=lambda: codes.append(setup.main()))
        thread.start()
        _wait_for(
            f"packages of this checkout are in use (process {os.getpid()})", lambda: str(said)
        )
        assert "build" not in programs.take()
    thread.join(5.0)
    assert codes == [0]
    assert "build" in programs.take()


def test_what_watches_a_running_graph_does_not_wait_for_it(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    setup.main()
    programs.take()
    (setup.SOURCES / "hri_planner" / "new.py").write_text("x = 1\n")
    monkeypatch.setattr(sys, "argv", ["setup", "--no-wait"])
    lock = setup.ROOT / ".run.lock"
    with lock.open("a") as graph, (setup.ROOT / ".setup.lock").open("w") as other:
        fcntl.flock(graph, fcntl.LOCK_SH)
        for waiting in (False, True):  # alone, or while another set-up waits for the graph
            if waiting:
                fcntl.flock(other, fcntl.LOCK_EX)
            capsys.readouterr()
            assert setup.main() == 0
            said = _one_line(capsys.readouterr().err)
            assert f"packages are in use (process {os.getpid()}): taking them as installed" in said
    assert "build" not in programs.take()
    assert setup.main() == 0  # the graph has ended
    assert "build" in programs.take()


def test_what_is_not_complete_is_waited_for(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs.failing["build"] = "error: no\n"
    assert setup.main() == 1
    programs.failing.clear()
    programs.take()
    said: list[str] = []
    monkeypatch.setattr(setup, "say", said.append)
    monkeypatch.setattr(sys, "argv", ["setup", "--no-wait"])
    with (setup.ROOT / ".run.lock").open("a") as other:
        fcntl.flock(other, fcntl.LOCK_SH)
        thread = threading.Thread(target=setup.main)
        thread.start()
        _wait_for("waiting for it to end", lambda: str(said))
    thread.join(5.0)
    assert "build" in programs.take()


def test_only_the_last_logs_are_kept(setup: ModuleType) -> None:
    log = setup.ROOT / "ros_ws" / "log"
    names = [f"build_2026-01-{day:02}_12-00-00" for day in range(1, 10)]
    for name in names:
        (log / name).mkdir(parents=True)
    (log / "latest_build").symlink_to(names[-1])
    setup.remove_old_logs()
    assert sorted(path.name for path in log.iterdir()) == [
        *names[-setup.KEPT_LOGS :],
        "latest_build",
    ]


def test_says_that_another_set_up_is_under_way(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(setup, "say", said.append)
    with (setup.ROOT / ".setup.lock").open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        thread = threading.Thread(target=setup.main)
        thread.start()
        _wait_for("another set-up of this checkout is under way", lambda: str(said))
        assert programs.take() == []
    thread.join(5.0)
    assert "build" in programs.take()


def test_a_node_holds_the_packages_until_it_ends(tmp_path: Path) -> None:
    """The lock outlives the replacement of the process by another program."""
    code = (
        "import os, pathlib, _project\n"
        f"_project.ROOT = pathlib.Path({str(tmp_path)!r})\n"
        "_project.keep_installed()\n"
        "print('held', flush=True)\n"
        "os.execv('/bin/cat', ['cat'])\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT / "scripts",
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        process.stdin.write("replaced\n")
        process.stdin.flush()
        assert process.stdout.readline() == "replaced\n"
        with (tmp_path / ".run.lock").open("a") as mine:
            with pytest.raises(BlockingIOError):
                fcntl.flock(mine, fcntl.LOCK_EX | fcntl.LOCK_NB)
            process.stdin.close()
            process.wait(5.0)
            fcntl.flock(mine, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_nodes_start_where_the_path_holds_a_space(setup: ModuleType, tmp_path: Path) -> None:
    setup.VENV = tmp_path / "with space" / ".venv"
    python = setup.VENV / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.symlink_to(sys.executable)
    node = setup.VENV / "lib" / "hri_sim" / "node"
    node.parent.mkdir(parents=True)
    node.write_text(f'#!"{python}"\nimport sys\nprint(sys.argv[1:])\n')
    node.chmod(0o755)
    setup.quote_interpreters()
    done = subprocess.run([str(node), "a b", "c"], capture_output=True, text=True, timeout=30)
    assert done.stdout == "['a b', 'c']\n", done.stderr


def test_dev_requirements_come_on_top(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup.main()
    programs.take()
    monkeypatch.setattr(sys, "argv", ["setup", "--dev"])
    assert setup.main() == 0
    assert programs.take() == ["pip --version", "pip install"]


def test_only_what_has_changed_is_built(
    setup: ModuleType, programs: Programs, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup.main()
    programs.take()
    built: list[list[str]] = []
    monkeypatch.setattr(setup, "remove_installed", built.append)
    (setup.SOURCES / "hri_planner" / "new.py").write_text("x = 1\n")
    assert setup.main() == 0
    assert built == [["hri_planner"]]
    assert programs.take() == ["pip --version", "build", "fill_cache"]


def test_new_requirements_rebuild_everything(setup: ModuleType, programs: Programs) -> None:
    setup.main()
    programs.take()
    (setup.REQUIREMENTS / "runtime.txt").write_text("numba==0.69.0\n")
    assert setup.main() == 0
    assert programs.take()[:3] == ["pip --version", "pip install", "build"]


def test_half_finished_environment_is_made_anew(
    setup: ModuleType, programs: Programs, capsys
) -> None:
    (setup.VENV / "lib").mkdir(parents=True)
    (setup.VENV / "lib" / "junk").write_text("")
    assert setup.main() == 0
    assert not (setup.VENV / "lib").exists()
    assert "incomplete" in capsys.readouterr().err


@pytest.mark.parametrize("how", ["pip is broken", "another Python"])
def test_unusable_environment_is_made_anew(setup: ModuleType, programs: Programs, how: str) -> None:
    setup.main()
    programs.take()
    if how == "pip is broken":
        programs.failing["pip --version"] = "No module named pip\n"
    else:
        setup.write_stamp("venv", "3.10 system_ros=False")
    assert setup.main() == 0
    assert programs.take() == ["pip --version", "-m venv", "pip install", "build", "fill_cache"]


def test_unreadable_stamps_count_as_none(setup: ModuleType, programs: Programs) -> None:
    setup.main()
    programs.take()
    setup.STAMPS.write_text("{")
    assert setup.main() == 0
    assert programs.take()[-1] == "fill_cache"


@pytest.mark.parametrize("where", ["pip install", "build", "fill_cache"])
def test_interrupted_set_up_goes_on(
    setup: ModuleType, programs: Programs, where: str, capsys
) -> None:
    programs.failing[where] = KeyboardInterrupt()
    assert setup.main() == 130
    assert "run it again to go on" in _one_line(capsys.readouterr().err)
    before = programs.take()
    programs.failing.clear()
    assert setup.main() == 0
    after = programs.take()
    assert after[:2] == ["pip --version", where]
    # Nothing that was complete is done again.
    assert not set(before[:-1]) & set(after)


def test_removes_what_is_gone(setup: ModuleType) -> None:
    site = setup.VENV / "lib" / "python3.11" / "site-packages"
    gone = [
        site / "hri_sim",
        site / "hri_sim-0.1.0.dist-info",
        setup.VENV / "lib" / "hri_sim",
        setup.VENV / "share" / "hri_sim",
    ]
    kept = site / "hri_simulacrum"
    for folder in (*gone, kept):
        folder.mkdir(parents=True)
    setup.remove_installed(["hri_sim"])
    assert not [folder for folder in gone if folder.exists()]
    assert kept.exists()
