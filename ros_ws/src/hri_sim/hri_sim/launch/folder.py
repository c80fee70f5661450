"""Folders of a run: checked before anything is started, and gone again when nothing was."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from hri_prediction.errors import ConfigError, HriError


class NewFolder:
    """A new or empty folder, made with its parents; what was made can be taken back.

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

    def discard(self, *files: str) -> None:
        """Remove some files of it, and the folders that were made for it and are empty."""
        for name in files:
            with contextlib.suppress(OSError):
                (self.path / name).unlink()
        if self._existed:
            with contextlib.suppress(OSError):
                self.path.mkdir(exist_ok=True)
        for folder in self._made:
            with contextlib.suppress(OSError):
                folder.rmdir()


class RunFolders:
    """Folder of a run and its bag's; unless :meth:`keep` is called, they are left as they were.

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
        self.bag = (bag or out / "bag").resolve()
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
        """What is in them now is worth something."""
        self._kept = True

    def __enter__(self) -> RunFolders:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if not self._kept:
            for folder in reversed(self._folders):
                folder.discard(*self._files)


@contextlib.contextmanager
def naming(option: str, value: object) -> Iterator[None]:
    """Errors within name the option of the command line that they are about, and what it got."""
    try:
        yield
    except HriError as error:
        given = f"{option} {value}"
        # Most errors name the file already: then the option goes before it.
        said = error.problem.replace(str(value), given, 1)
        problem = said if given in said else f"{given}: {error.problem}"
        raise type(error)(problem, expected=error.expected, hint=error.hint) from error
