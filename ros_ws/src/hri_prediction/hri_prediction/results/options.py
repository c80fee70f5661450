"""Options and answers that the command lines of resumable work have in common."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from hri_prediction.errors import ConfigError

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


@contextmanager
def resumable(console: Console, folder: Path) -> Iterator[None]:
    """Ctrl-C ends the work inside with code 130, and says from where it can go on."""
    try:
        yield
    except KeyboardInterrupt:
        console.print(
            f"stopped; the same command goes on from what is in {folder}", highlight=False
        )
        raise typer.Exit(130) from None
