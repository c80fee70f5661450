"""Set-up of the project's environment: standard library only, run by scripts/setup.

Four steps, each remembered by a stamp that is written when the step is complete: virtual environment,
locked requirements, colcon build of ros_ws, compiled kernels. A step runs again when what it depends
on has changed, so an interrupted set-up goes on where it stopped.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from typing import IO

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMPS = VENV / ".setup.json"
SOURCES = ROOT / "ros_ws" / "src"
REQUIREMENTS = ROOT / "requirements"
PYTHON_PACKAGES = ("hri_prediction", "hri_planner", "hri_sim")
KEPT_LOGS = 5
SYSTEM_ROS = Path(os.environ.get("HRI_SYSTEM_ROS", "/opt/ros/jazzy"))


class SetupError(Exception):
    """One clear line for the user."""


class PackagesInUse(Exception):
    """What is installed is complete, in use, and to stay as it is; the text says by whom."""


def say(text: str) -> None:
    """One line of progress on stderr: stdout belongs to the caller."""
    print(f"setup: {text}", file=sys.stderr, flush=True)


class PackagesLock:
    """What lets set-up wait until no graph of this checkout uses what it is about to replace.

    The scripts that run nodes share the lock (see _project.py); set-up takes it for itself alone, and
    only when it has something to replace.

    Args:
        wait: Whether to wait for running graphs; otherwise complete packages are left to them.
    """

    def __init__(self, wait: bool = True) -> None:
        self._file: IO[str] | None = None
        self._wait = wait

    def take(self) -> None:
        """Wait for running graphs, saying so; a second call does nothing.

        Raises:
            PackagesInUse: instead of waiting, when that is not wanted.
        """
        if self._file is not None:
            return
        file = (ROOT / ".run.lock").open("a")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self.leave_to_graphs()
            say(
                f"packages of this checkout are in use (process {self._holders()}), and are to be "
                "replaced: waiting for it to end; stop it, or press Ctrl-C to leave all as it is"
            )
            fcntl.flock(file, fcntl.LOCK_EX)
        self._file = file

    def leave_to_graphs(self) -> None:
        """Do nothing when waiting is wanted, nobody uses the packages, or they are not complete.

        Raises:
            PackagesInUse: otherwise.
        """
        if self._wait or not read_stamps().keys() >= {"runtime", "hri_msgs", *PYTHON_PACKAGES}:
            return
        with (ROOT / ".run.lock").open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                pass
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return  # in use by another set-up, which is replacing them
            raise PackagesInUse(self._holders())

    def _holders(self) -> str:
        """Process ids of those that have the lock, as far as the kernel tells."""
        inode = (ROOT / ".run.lock").stat().st_ino
        try:
            rows = [line.split() for line in Path("/proc/locks").read_text().splitlines()]
        except OSError:
            rows = []
        found = {r[4] for r in rows if r[1] == "FLOCK" and r[5].rsplit(":", 1)[-1] == str(inode)}
        return ", ".join(sorted(found)) or "unknown"

    def close(self) -> None:
        """Let graphs start again."""
        if self._file is not None:
            self._file.close()


def hash_files(paths: list[Path]) -> str:
    """Hash of names and contents; missing files count as empty."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0")
        if path.is_file():
            digest.update(path.read_bytes())
    return digest.hexdigest()


def source_files(package: str) -> list[Path]:
    """Files of one ROS package that decide what gets installed."""
    return [
        path
        for path in (SOURCES / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts and ".egg-info" not in str(path)
    ]


def uses_system_ros() -> bool:
    """Whether a ROS 2 Jazzy installation is sourced in this shell."""
    return os.environ.get("ROS_DISTRO") == "jazzy" and str(SYSTEM_ROS) in os.environ.get(
        "AMENT_PREFIX_PATH", ""
    )


def read_stamps() -> dict[str, str]:
    """Stamps of the steps that were completed."""
    try:
        stamps = json.loads(STAMPS.read_text())
    except (OSError, ValueError):
        return {}
    return stamps if isinstance(stamps, dict) else {}


def write_stamp(name: str, value: str) -> None:
    """Remember a completed step, atomically."""
    stamps = read_stamps() | {name: value}
    temporary = STAMPS.with_suffix(".tmp")
    temporary.write_text(json.dumps(stamps, indent=1))
    temporary.replace(STAMPS)


def run(command: list[str], what: str, hints: dict[str, str], env: dict[str, str]) -> None:
    """Run a command with its output in .venv/setup.log.

    Raises:
        SetupError: in one line, with the hint whose key stands in the output.
    """
    log = VENV / "setup.log"
    with log.open("ab") as stream:
        stream.write(f"\n$ {' '.join(command)}\n".encode())
        stream.flush()
        start = stream.tell()
        process = subprocess.run(
            command, stdout=stream, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, env=env
        )
    if process.returncode == 0:
        return
    with log.open("rb") as stream:
        stream.seek(start)
        output = stream.read().decode(errors="replace")
    for key, hint in hints.items():
        if key in output:
            raise SetupError(f"{what} failed: {hint} (details: {log})")
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    last = next(
        (line for line in reversed(lines) if "error" in line.lower()), lines[-1] if lines else ""
    )
    raise SetupError(f"{what} failed: {last[:200]} (details: {log})")


def environment(system_ros: bool) -> dict[str, str]:
    """Environment for the environment's own programs."""
    env = dict(os.environ)
    for name in ("PYTHONHOME", "PYTHONPATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"):
        if name != "PYTHONPATH" or not system_ros:
            env.pop(name, None)
    env["VIRTUAL_ENV"] = str(VENV)
    env["PATH"] = f"{VENV / 'bin'}{os.pathsep}{env.get('PATH', '')}"
    env["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    prefixes = [str(VENV)]
    if system_ros:
        prefixes.append(env["AMENT_PREFIX_PATH"])
    env["AMENT_PREFIX_PATH"] = env["CMAKE_PREFIX_PATH"] = os.pathsep.join(prefixes)
    return env


def check_compiler() -> None:
    """A C and C++ compiler and Python's headers are the only things wanted from the system."""
    missing = [
        name
        for name, choices in {
            "a C compiler": ("cc", "gcc", "clang"),
            "a C++ compiler": ("c++", "g++", "clang++"),
        }.items()
        if not any(shutil.which(choice) for choice in choices)
    ]
    if missing:
        raise SetupError(
            f"{' and '.join(missing)} not found; run: sudo apt-get install build-essential"
        )
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    if not header.exists():
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise SetupError(f"{header} not found; run: sudo apt-get install python{version}-dev")


def make_venv(system_ros: bool, packages: PackagesLock) -> None:
    """Create .venv, or make it anew when it is broken or of another kind."""
    kind = f"{sys.version_info.major}.{sys.version_info.minor} system_ros={system_ros}"
    python = VENV / "bin" / "python"
    works = python.exists() and (
        subprocess.run([str(python), "-m", "pip", "--version"], capture_output=True).returncode == 0
    )
    if works and read_stamps().get("venv") == kind:
        return
    packages.take()
    if VENV.exists():
        say("the environment in .venv is incomplete or of another kind: making it anew")
        shutil.rmtree(VENV)
    say(
        f"making .venv with Python {kind.split()[0]}"
        + (f" beside {SYSTEM_ROS}" if system_ros else "")
    )
    command = [sys.executable, "-m", "venv", str(VENV)]
    if system_ros:
        command.append("--system-site-packages")
    process = subprocess.run(command, capture_output=True, text=True)
    if process.returncode != 0:
        shutil.rmtree(VENV, ignore_errors=True)
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise SetupError(
            f"cannot make a virtual environment; run: sudo apt-get install python{version}-venv"
            f" ({(process.stderr or process.stdout).strip().splitlines()[-1:]})"
        )
    write_stamp("venv", kind)


def install_requirements(
    system_ros: bool, dev: bool, env: dict[str, str], packages: PackagesLock
) -> None:
    """Install the locked requirements."""
    runtime = REQUIREMENTS / ("runtime_system_ros.txt" if system_ros else "runtime.txt")
    steps = [("runtime", runtime)]
    if dev:
        steps.append(("dev", REQUIREMENTS / "dev.txt"))
    not_offered = (
        "the package index does not offer a locked version; "
        "check the network and pip's index settings"
    )
    no_network = "no network: cannot reach the package index; connect and run again"
    hints = {
        "No matching distribution": not_offered,
        "Could not find a version": not_offered,
        "Temporary failure in name resolution": no_network,
        "NewConnectionError": no_network,
        "ConnectTimeoutError": no_network,
        "No space left": "the disk is full; about 2 GB are needed",
    }
    for name, path in steps:
        stamp = hash_files([path])
        if read_stamps().get(name) == stamp:
            continue
        packages.take()
        say(f"installing {name} requirements (a few minutes the first time)")
        # pip ends with "No matching distribution" also when it had no connection: look for that first.
        ordered = dict(sorted(hints.items(), key=lambda item: "index does not offer" in item[1]))
        command = [
            str(VENV / "bin" / "python"),
            "-m",
            "pip",
            "install",
            "--retries",
            "2",
            "-r",
            str(path),
        ]
        run(command, f"installing {path.name}", ordered, env)
        write_stamp(name, stamp)


def remove_installed(packages: list[str]) -> None:
    """Remove our own installed packages: a rebuild does not delete modules that are gone."""
    for package in packages:
        for path in (
            *VENV.glob(f"lib/python3*/site-packages/{package}"),
            *VENV.glob(f"lib/python3*/site-packages/{package}-*"),
            VENV / "share" / package,
            VENV / "lib" / package,
            VENV / "include" / package,
            ROOT / "ros_ws" / "build" / package,
        ):
            if path.is_dir():
                shutil.rmtree(path)


def quote_interpreters() -> None:
    """Let the nodes start where the path of the checkout holds a space.

    setuptools quotes the interpreter in their first line, which the kernel does not understand; pip
    goes through a shell instead, and so does this.
    """
    python = VENV / "bin" / "python"
    if " " not in str(python):
        return
    for package in PYTHON_PACKAGES:
        for path in (VENV / "lib" / package).glob("*"):
            first, _, rest = path.read_text().partition("\n")
            if path.is_file() and first.startswith('#!"'):
                head = f"#!/bin/sh\n'''exec' \"{python}\" \"$0\" \"$@\"\n' '''\n"
                path.write_text(head + rest)


def build_workspace(env: dict[str, str], packages: PackagesLock) -> None:
    """Build with colcon what has changed, into .venv."""
    stamps = read_stamps()
    requirements = stamps["runtime"]
    wanted = {
        package: hashlib.sha256(
            (requirements + hash_files(source_files(package))).encode()
        ).hexdigest()
        for package in ("hri_msgs", *PYTHON_PACKAGES)
    }
    changed = [package for package, stamp in wanted.items() if stamps.get(package) != stamp]
    if not changed:
        return
    if "hri_msgs" in changed:
        check_compiler()
    packages.take()
    say(f"building {', '.join(changed)}")
    remove_installed(changed)
    ros_ws = ROOT / "ros_ws"
    colcon = shutil.which("colcon", path=env["PATH"])
    if colcon is None:
        raise SetupError(
            "colcon not found; run: sudo apt-get install python3-colcon-common-extensions"
        )
    command = [
        # With our own Python: colcon writes the interpreter that runs it into the nodes' first lines.
        str(VENV / "bin" / "python"), colcon, "--log-base", str(ros_ws / "log"), "build",
        "--base-paths", str(SOURCES),
        "--build-base", str(ros_ws / "build"), "--install-base", str(VENV), "--merge-install",
        "--packages-select", *changed, "--cmake-args", "-DBUILD_TESTING=OFF", "-DCMAKE_BUILD_TYPE=Release",
        f"-DPython3_EXECUTABLE={VENV / 'bin' / 'python'}",
    ]  # fmt: skip
    if (VENV / "bin" / "ninja").exists():
        command += ["-GNinja"]
    run(command, "colcon build", {"No space left": "the disk is full"}, env)
    quote_interpreters()
    remove_old_logs()
    for package, stamp in wanted.items():
        write_stamp(package, stamp)


def remove_old_logs() -> None:
    """Keep the logs of the last builds alone: colcon makes a folder for each."""
    folders = [path for path in (ROOT / "ros_ws" / "log").glob("build_*") if not path.is_symlink()]
    for folder in sorted(folders)[:-KEPT_LOGS]:  # named by their time
        shutil.rmtree(folder, ignore_errors=True)


def warm_kernels(env: dict[str, str]) -> None:
    """Compile the kernels once, so that no node has to do so while it runs."""
    stamps = read_stamps()
    stamp = "".join(stamps[package][:8] for package in PYTHON_PACKAGES)
    if stamps.get("kernels") == stamp:
        return
    say("compiling kernels")
    code = (
        "import hri_sim.warm as w; w.fill_cache(); "
        "import hri_prediction.compiled as c; c.remove_unused_caches()"
    )
    run([str(VENV / "bin" / "python"), "-c", code], "compiling kernels", {}, env)
    write_stamp("kernels", stamp)


def _lock_soon(opened: int) -> bool:
    """Whether the lock is free within a few seconds: nodes that start at once only look, one by one."""
    until = time.monotonic() + 3.0
    while time.monotonic() < until:
        time.sleep(0.05)
        try:
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            continue
        return True
    return False


def main() -> int:
    """Run the steps that are due."""
    parser = argparse.ArgumentParser(prog="setup", description=__doc__.split("\n\n")[0])
    parser.add_argument("--dev", action="store_true", help="also what tests and linters need")
    parser.add_argument(
        "--no-wait",
        action="store_true",
        help="while a graph runs, leave what is installed as it is: for what watches the graph",
    )
    arguments = parser.parse_args()
    start = time.monotonic()
    system_ros = uses_system_ros()
    packages = PackagesLock(wait=not arguments.no_wait)
    try:
        lock_path = ROOT / ".setup.lock"
        with lock_path.open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                packages.leave_to_graphs()
                if not _lock_soon(lock.fileno()):
                    say("another set-up of this checkout is under way: waiting for it to end")
                    fcntl.flock(lock, fcntl.LOCK_EX)
            before = read_stamps()
            make_venv(system_ros, packages)
            env = environment(system_ros)
            install_requirements(system_ros, arguments.dev, env, packages)
            build_workspace(env, packages)
            warm_kernels(env)
        if read_stamps() != before:
            say(f"ready after {time.monotonic() - start:.0f} s")
    except PackagesInUse as error:
        say(
            f"packages are in use (process {error}): taking them as installed, without later changes"
        )
    except SetupError as error:
        print(f"setup: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"setup: {error.strerror}: {error.filename}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("setup: interrupted; run it again to go on", file=sys.stderr)
        return 130
    finally:
        packages.close()
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    sys.exit(main())
