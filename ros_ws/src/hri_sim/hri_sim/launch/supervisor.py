"""Starts every node as its own process, watches them, stops them all."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import yaml

from hri_prediction.errors import GraphError
from hri_prediction.ros.scheduling import share_processors
from hri_sim.launch.folder import LOGS, PARAMETERS
from hri_sim.launch.precedence import niceness, urgency

_PR_SET_PDEATHSIG = 1
STOP_TIMEOUT_S = 5.0
"""How long a node may take to end after SIGINT, unless its specification gives it longer [s]."""

_LOOK_S = 0.05
"""How often a node that is to end is looked at [s]."""


@dataclass(frozen=True)
class NodeSpec:
    """One node process.

    Attributes:
        package: ROS package.
        executable: Executable of it, under ``lib/<package>``.
        parameters: Parameter values by name.
        name: Node name, when not the executable's own.
        essential: Whether the run cannot go on without it.
        last: Whether it is stopped after all others (the recorder, to miss nothing).
        stop_timeout_s: How long it may take to end after SIGINT before it is killed [s].
        own_folder: Parameter that names a new folder; one that is started again gets another: ``_2`` and
            so on.
    """

    package: str
    executable: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""
    essential: bool = True
    last: bool = False
    stop_timeout_s: float = STOP_TIMEOUT_S
    own_folder: str = ""

    @property
    def label(self) -> str:
        """Name of the node."""
        return self.name or self.executable


_ASKED = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
"""Signals that somebody sends; others a process gets for what it did, and says something of before."""


@dataclass(frozen=True)
class Death:
    """A node that ended by itself.

    Attributes:
        label: Name of the node.
        code: Exit code; negative: the signal that ended it.
        last_words: Its last lines.
    """

    label: str
    code: int
    last_words: tuple[str, ...]

    def __str__(self) -> str:
        if self.code < 0:
            with contextlib.suppress(ValueError):
                how = f"was ended by {signal.Signals(-self.code).name}"
                return f"node {self.label} {how}"
        return f"node {self.label} ended with exit code {self.code}"

    @property
    def cause(self) -> str:
        """What a node that ended with an error said at last; empty when somebody ended it."""
        asked = self.code == 0 or -self.code in _ASKED
        return self.last_words[-1] if self.last_words and not asked else ""


def find_executable(package: str, executable: str) -> Path:
    """Path of a node's executable, as ``ros2 run`` finds it.

    Raises:
        GraphError: when no prefix of ``AMENT_PREFIX_PATH`` has it.
    """
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    for prefix in prefixes or [sys.prefix]:
        path = Path(prefix) / "lib" / package / executable
        if path.exists():
            return path
    raise GraphError(
        f"executable {executable} of package {package} is not installed",
        expected=f"lib/{package}/{executable} under one of: {', '.join(prefixes) or sys.prefix}",
        hint="run scripts/setup, or build and source ros_ws",
    )


try:
    _LIBC: ctypes.CDLL | None = ctypes.CDLL(None)
except OSError:  # pragma: no cover - a system without a C library to load
    _LIBC = None


def die_with(parent: int) -> None:
    """In the child: end when the supervisor dies, however it dies. No imports, no locks: a fork.

    Args:
        parent: Its process id. In a container it may be 1, which elsewhere is who takes in orphans.
    """
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
    if os.getppid() != parent:  # it died before the line above
        os._exit(1)


def _begin(parent: int, more: int) -> None:
    """In the child, before it is the node: :func:`die_with`; and its niceness, and its threads'."""
    die_with(parent)
    share_processors()
    os.nice(more)


class Supervisor:
    """Node processes of one run.

    Args:
        folder: Gets ``parameters/<node>.yaml`` and ``log/<node>.log``.
        environment: Further environment variables of the nodes.

    Raises:
        GraphError: from :meth:`start`, when an executable is missing.
    """

    def __init__(self, folder: Path, environment: Mapping[str, str] | None = None) -> None:
        self.folder = folder
        self._environment = {**os.environ, **(environment or {})}
        self._specs: dict[str, NodeSpec] = {}
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._reported: set[str] = set()
        self._dead: set[str] = set()
        self._starts: Counter[str] = Counter()

    def __enter__(self) -> Supervisor:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the nodes."""
        return tuple(self._specs)

    @property
    def pids(self) -> dict[str, int]:
        """Process ids of the nodes that run."""
        return {name: p.pid for name, p in self._processes.items() if p.poll() is None}

    def log_path(self, label: str) -> Path:
        """Where a node's output goes."""
        return self.folder / LOGS / f"{label}.log"

    def start(self, specs: Sequence[NodeSpec]) -> None:
        """Start nodes; nothing is written and none is started when one is not installed."""
        executables = [find_executable(spec.package, spec.executable) for spec in specs]
        for name in (LOGS, PARAMETERS):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        for spec, executable in zip(specs, executables, strict=True):
            self._start(spec, executable, "wb")

    def start_again(self, label: str) -> None:
        """Start a node that has ended once more; its log goes on."""
        spec = self._specs[label]
        if spec.own_folder:
            # What it wrote stays as it is.
            self._starts[label] += 1
            folder = f"{spec.parameters[spec.own_folder]}_{self._starts[label] + 1}"
            spec = replace(spec, parameters={**spec.parameters, spec.own_folder: folder})
        self._start(spec, find_executable(spec.package, spec.executable), "ab")
        self._reported.discard(label)

    def _start(self, spec: NodeSpec, executable: Path, mode: str) -> None:
        command = [str(executable), "--ros-args"]
        if spec.name:
            command += ["-r", f"__node:={spec.name}"]
        parameters = {**urgency(spec.executable), **spec.parameters}
        if parameters:
            path = self.folder / PARAMETERS / f"{spec.label}.yaml"
            # "/**" also matches a node that is put into a namespace.
            values = {"/**": {"ros__parameters": parameters}}
            path.write_text(yaml.safe_dump(values, sort_keys=False))
            command += ["--params-file", str(path)]
        with self.log_path(spec.label).open(mode) as log:
            self._processes[spec.label] = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self._environment,
                # Ctrl-C reaches only the supervisor, which stops the nodes in order. In sessions of their
                # own, niceness would mean nothing where the kernel shares processors among sessions.
                process_group=0,
                preexec_fn=functools.partial(_begin, os.getpid(), niceness(spec.executable)),
            )
        self._specs.setdefault(spec.label, spec)

    def last_words(self, label: str, lines: int = 8) -> tuple[str, ...]:
        """The last lines that a node printed."""
        try:
            text = self.log_path(label).read_text(errors="replace")
        except OSError:
            return ()
        return tuple(line for line in text.splitlines() if line.strip())[-lines:]

    def deaths(self) -> list[Death]:
        """Nodes that have ended by themselves since the last call."""
        found = []
        for label, process in self._processes.items():
            code = process.poll()
            if code is not None and label not in self._reported:
                self._reported.add(label)
                self._dead.add(label)
                found.append(Death(label, code, self.last_words(label)))
        return found

    def died(self, label: str) -> bool:
        """Whether the node was found to have ended by itself."""
        return label in self._dead

    def exit_code(self, label: str) -> int | None:
        """How a node ended (negative: by which signal); none while it runs, or when it is none of ours."""
        process = self._processes.get(label)
        return None if process is None else process.poll()

    def is_essential(self, label: str) -> bool:
        """Whether the run cannot go on without the node."""
        return self._specs[label].essential

    def end(self, label: str, within_s: float) -> None:
        """End a node as :meth:`stop` does, or by SIGKILL if that takes longer [s]."""
        self._reported.add(label)
        self.send(label, signal.SIGINT)
        try:
            self._processes[label].wait(within_s)
        except subprocess.TimeoutExpired:
            self.kill(label)

    def send(self, label: str, number: int) -> None:
        """Send a signal to a node, unless it has ended."""
        with contextlib.suppress(ProcessLookupError):
            self._processes[label].send_signal(number)

    def kill(self, label: str) -> None:
        """End a node at once, with SIGKILL."""
        self._processes[label].kill()
        self._processes[label].wait()

    def stop(
        self,
        tell: Callable[[str], None] = lambda text: None,
        hurry: Callable[[], int] = lambda: 0,
    ) -> list[str]:
        """Stop all nodes, the recorder last.

        Args:
            tell: Takes a line about a node that is waited for longer than usual, or is not.
            hurry: How often the user has asked for it to be quicker. From the first time on nodes are
                killed at once, except the recorder, which is so from the second on.

        Returns:
            Those that had to be killed.
        """
        killed: list[str] = []
        for last in (False, True):
            batch = [name for name, spec in self._specs.items() if spec.last is last]
            running = [name for name in batch if self._processes[name].poll() is None]
            killed += self._stop(running, tell, hurry, 2 if last else 1)
        self._reported.update(self._specs)
        return killed

    def _stop(
        self, labels: list[str], tell: Callable[[str], None], hurry: Callable[[], int], enough: int
    ) -> list[str]:
        for label in labels:
            self.send(label, signal.SIGINT)
        begin = time.monotonic()
        killed = []
        for label in labels:
            limit_s = self._specs[label].stop_timeout_s
            told = limit_s <= STOP_TIMEOUT_S
            while not self._ends(label):
                waited_s = time.monotonic() - begin
                if waited_s > limit_s or hurry() >= enough:
                    self.kill(label)
                    killed.append(label)
                    break
                if not told and (waited_s > STOP_TIMEOUT_S or hurry()):
                    told = True
                    tell(
                        f"{label} is still writing: it is killed if that takes more than "
                        f"{limit_s:.0f} s, or at the next Ctrl-C"
                    )
        return killed

    def _ends(self, label: str) -> bool:
        """Whether a node ends soon."""
        try:
            self._processes[label].wait(_LOOK_S)
        except subprocess.TimeoutExpired:
            return False
        return True
