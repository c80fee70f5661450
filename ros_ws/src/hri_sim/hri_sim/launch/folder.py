"""Folders of a run: checked before anything is started, and gone again when nothing was."""

from __future__ import annotations

import contextlib
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from hri_prediction.errors import ConfigError, HriError

LOGS, PARAMETERS, BAG = "log", "parameters", "bag"
"""Folders of a run."""
NOT_BEGUN = "did_not_begin"
"""A file among the logs that says that there was no run: the next one may use the folder."""


def holds_a_run(folder: Path) -> bool:
    """Whether a folder holds what a run has left, other than the logs of one that did not begin."""
    logs = folder / LOGS
    return logs.is_dir() and not (logs / NOT_BEGUN).is_file()


class NewFolder:
    """A new or empty folder, made with its parents; what was made can be taken back.

    One that only holds the logs of a run that did not begin counts as empty, and is emptied.

    Args:
        folder: Path of it.
        option: Option of the command line that names it.

    Raises:
        ConfigError: when it is not empty, is a file, or cannot be written.
    """

    def __init__(self, folder: Path, option: str) -> None:
        self.path = folder
        self._existed = folder.exists()
        self._made = [path for path in (folder, *folder.parents) if not path.exists()]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            names = [path.name for path in folder.iterdir()]
            if names == [LOGS] and not holds_a_run(folder):
                shutil.rmtree(folder / LOGS)
            if any(folder.iterdir()):
                raise ConfigError(
                    f"{option} {folder} is not empty",
                    expected="a new or empty folder",
                    hint=f"choose another with {option}",
                )
            probe = folder / ".probe"
            probe.write_text("")
            probe.unlink()
        except OSError as error:
            self.discard()
            raise ConfigError(
                f"cannot write to {option} {folder}: {error.strerror}",
                expected="a folder that is new or empty, and may be written",
                hint=f"choose another with {option}",
            ) from error

    def discard(self, *names: str) -> None:
        """Remove some files and folders of it, and those that were made for it and are empty."""
        for name in names:
            remove(self.path / name)
        if self._existed:
            with contextlib.suppress(OSError):
                self.path.mkdir(exist_ok=True)
        for folder in self._made:
            with contextlib.suppress(OSError):
                folder.rmdir()


def remove(path: Path) -> None:
    """Remove a file or a folder with all that it holds, if it is there and can be removed."""
    with contextlib.suppress(OSError):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


class RunFolders:
    """Folder of a run and its bag's; unless :meth:`keep` is called, they are left as they were.

    Only the logs of nodes that ran into an error stay, marked so that they do not bar the next try.

    Args:
        out: Folder of the run.
        bag: Bag folder to be made by the recorder, when it is not the one in ``out``.
        files: Files that are written into ``out`` before anything is started.

    Raises:
        ConfigError: when one cannot be used; nothing is left behind then either.
    """

    def __init__(self, out: Path, bag: Path | None, files: tuple[str, ...]) -> None:
        self._files = files
        self._kept = False
        self.bag = (bag or out / BAG).resolve()
        if bag is not None and self.bag in (out.resolve(), *out.resolve().parents):
            raise ConfigError(
                f"--record {bag} is or holds the folder of the run, {out}",
                expected="a bag folder of its own",
                hint="choose another with --record, or leave it out: the bag goes into --out",
            )
        self._folders = [NewFolder(out, "--out")]
        if bag is not None:
            try:
                self._folders.append(NewFolder(bag, "--record"))
                bag.rmdir()  # the recorder makes it
            except HriError:
                self._folders[0].discard()
                raise

    def keep(self) -> None:
        """The run begins: what is in them from now on is worth something."""
        self._kept = True

    def __enter__(self) -> RunFolders:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._kept:
            return
        run, *others = self._folders
        if others:
            remove(self.bag)
        logs = run.path / LOGS
        marked = False
        if isinstance(error, HriError) and logs.is_dir():
            with contextlib.suppress(OSError):  # the disk may be full
                (logs / NOT_BEGUN).write_text(f"{error}\n")
                marked = True
        if not marked:
            remove(logs)
        run.discard(*self._files, PARAMETERS, BAG)
        for folder in others:
            folder.discard()


@contextlib.contextmanager
def naming(option: str, value: object) -> Iterator[None]:
    """Errors within name the option of the command line that they are about, and what it got."""
    try:
        yield
    except HriError as error:
        given = f"{option} {value}"
        # Most errors name the file already: then the option goes before it.
        quoted = repr(str(value)) in error.problem
        # As a word: what ships by that name lies in a path that ends in it.
        word = rf"(?<![\w/.-]){re.escape(str(value))}(?!\w)"
        said = error.problem if quoted else re.sub(word, lambda _: given, error.problem, count=1)
        problem = said if given in said else f"{given}: {error.problem}"
        raise type(error)(problem, expected=error.expected, hint=error.hint) from error
