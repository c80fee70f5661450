"""A process that reads one altered file after the other, and may neither hang, nor crash, nor swell.

It is forked from the tests, so that nothing need be loaded again, and is given so much memory on top of
what it has then. What the reader does with a file is told by a :class:`Verdict`; a process that dies takes
the file's verdict with it, and another one takes its place.
"""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import resource
import signal
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from hri_prediction.errors import HriError

_FORK = multiprocessing.get_context("fork")
CANARY = "executed"
"""Folder that a file may try to make where it is read: its path differs, the files are to be the same."""
LONGEST_TEXT = 10_000
"""An error that says more than that says nothing [characters]."""
_FILES_A_PROCESS = 300
"""What a process has forgotten to give back is not to add up to the limit."""


@dataclass(frozen=True)
class Verdict:
    """What became of a file.

    Attributes:
        kind: ``"read"``, ``"refused"`` (by an error of ours) or ``"fault"``.
        text: The error; of a fault, all that is known.
    """

    kind: str
    text: str = ""


class Sandbox:
    """Reads files within limits.

    Args:
        read: Reader; what it returns does not matter.
        folder: For the canary and for what the process says.
        seconds: For one file.
        memory: On top of what the tests' process has [bytes].

    Attributes:
        canary: What is in a file may try to make this folder; it must never be there.
        count: Files until now, by the kind of their verdicts.
    """

    def __init__(
        self,
        read: Callable[[Path], object],
        folder: Path,
        *,
        seconds: float = 10.0,
        memory: float = 512e6,
    ) -> None:
        folder.mkdir()
        self.canary = folder / CANARY
        self.count = {"read": 0, "refused": 0, "fault": 0}
        self._read = read
        self._log = folder / "said"
        self._limits = seconds, int(memory)
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._files = 0

    def verdict(self, path: Path) -> Verdict:
        """What becomes of a file."""
        if self._files >= _FILES_A_PROCESS:
            self.close()
        if self._process is None:
            self._begin()
        assert self._pipe is not None
        self._files += 1
        found = self._asked(path)
        if self.canary.exists():
            found = Verdict("fault", "the file had something executed")
            self.canary.rmdir()
        self.count[found.kind] += 1
        return found

    def check(self, path: Path) -> Verdict:
        """The verdict, which must not be a fault; a refusal names the file, and is short."""
        found = self.verdict(path)
        assert found.kind != "fault", f"{path}: {found.text}"
        if found.kind == "refused":
            assert path.name in found.text, f"{path} is not named: {found.text[:1000]}"
            assert len(found.text) <= LONGEST_TEXT, f"{path}: {len(found.text)} characters"
        return found

    def close(self) -> None:
        """End the process."""
        if self._process is not None and self._pipe is not None:
            if self._process.is_alive():
                self._process.kill()
            self._process.join()
            self._pipe.close()
        self._process = self._pipe = None

    def _begin(self) -> None:
        self._pipe, theirs = _FORK.Pipe()
        self._log.write_text("")
        self._process = _FORK.Process(
            target=_serve, args=(self._read, theirs, self._log, *self._limits), daemon=True
        )
        self._process.start()
        theirs.close()
        self._files = 0

    def _asked(self, path: Path) -> Verdict:
        assert self._pipe is not None
        assert self._process is not None
        try:
            self._pipe.send(path)
            # It ends itself when time is up; this is for when it cannot.
            if self._pipe.poll(self._limits[0] + 10.0):
                answer = self._pipe.recv()
                assert isinstance(answer, Verdict)
                return answer
        except (EOFError, OSError):
            pass
        self._process.join(1.0)
        code = self._process.exitcode
        name = signal.Signals(-code).name if code is not None and code < 0 else f"code {code}"
        self.close()
        said = self._log.read_text(errors="replace")[-6000:]
        return Verdict("fault", f"the process ended: {'hung' if code is None else name}\n{said}")


def _serve(
    read: Callable[[Path], object], pipe: Connection, log: Path, seconds: float, memory: int
) -> None:
    said = os.open(log, os.O_WRONLY | os.O_APPEND)
    for stream in (1, 2):
        os.dup2(said, stream)
    os.chdir(log.parent)
    warnings.simplefilter("ignore")  # numbers that overflow are none of a file's crimes
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    faulthandler.enable(said)
    while True:
        path = pipe.recv()
        # Ends a process that hangs, in compiled code too, and says where.
        faulthandler.dump_traceback_later(seconds, exit=True, file=said)
        verdict = _tried(read, path)
        faulthandler.cancel_dump_traceback_later()
        pipe.send(verdict)


def _tried(read: Callable[[Path], object], path: Path) -> Verdict:
    try:
        read(path)
    except HriError as error:
        if any(isinstance(cause, MemoryError) for cause in _causes(error)):
            return Verdict("fault", f"asked for more memory than it may have\n{_trace(error)}")
        return Verdict("refused", _plain(str(error)))
    except BaseException as error:
        return Verdict("fault", _trace(error))
    return Verdict("read")


def _causes(error: BaseException) -> Iterator[BaseException]:
    """Those from which an error was raised, or while which."""
    cause = error.__cause__ or error.__context__
    while cause is not None:
        yield cause
        cause = cause.__cause__ or cause.__context__


def _trace(error: BaseException) -> str:
    text = _plain("".join(traceback.format_exception(error)))
    return text if len(text) < 8000 else f"{text[:3000]}\n...\n{text[-5000:]}"


def _plain(text: str) -> str:
    """Without what is no character, which an array may hold and a pipe does not take."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8", "replace")
