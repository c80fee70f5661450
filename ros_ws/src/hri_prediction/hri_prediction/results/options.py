"""Options and answers that the command lines of resumable work have in common."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError, HriError

Workers = Annotated[
    int | None, typer.Option(help="Processes (default: one a core).", min=1, show_default=False)
]
Scheduler = Annotated[
    str | None,
    typer.Option(help="Address of a Dask scheduler that has the work done instead."),
]


def make_folders(**folders: Path) -> None:
    """Make the folders that options name.

    Args:
        folders: Each by the name of its option.

    Raises:
        ConfigError: naming the option whose folder cannot be made.
    """
    for name, folder in folders.items():
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(
                f"cannot make --{name} {folder}: {error.strerror}",
                hint=f"choose another with --{name}",
            ) from error


def run_app(app: typer.Typer, name: str, argv: Sequence[str] | None = None) -> int:
    """Run a command line; what is wrong is a line on stderr.

    Args:
        app: The command line.
        name: Of the script.
        argv: Arguments; none: those of the process.

    Returns:
        Its exit code: 1 when something is wrong.
    """
    try:
        app(args=None if argv is None else list(argv), prog_name=name)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    except HriError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        print(f"error: {where}{error.strerror or error}", file=sys.stderr)
        return 1
    return 0


@contextmanager
def resumable(console: Console, folder: Path | None) -> Iterator[None]:
    """Ctrl-C ends the work inside with code 130, and says from where it can go on; None: from nowhere."""
    try:
        yield
    except KeyboardInterrupt:
        goes_on = (
            "nothing of it is kept"
            if folder is None
            else f"the same command goes on from what is in {folder}"
        )
        console.print(f"stopped; {goes_on}", highlight=False)
        raise typer.Exit(130) from None
