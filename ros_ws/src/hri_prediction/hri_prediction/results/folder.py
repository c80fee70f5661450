"""The folder that results go into, checked before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hri_prediction.errors import ConfigError


def check_folder(out: Path, names: Sequence[str], overwrite: bool) -> None:
    """Whether results may go into a folder; asked before the work, which takes its time.

    Args:
        out: The folder; it need not exist.
        names: Files that will be written.
        overwrite: Whether files of these names may be replaced.

    Raises:
        ConfigError: it is no folder, or holds results that are not to be replaced.
    """
    if out.suffix in (".npz", ".json") or out.is_file():
        raise ConfigError(
            f"--out {out} is a file", expected=f"a folder; {names[0]} and a report go into it"
        )
    there = [name for name in names if (out / name).exists()]
    if there and not overwrite:
        raise ConfigError(
            f"{out} already holds {', '.join(there)}", hint="name another folder or add --overwrite"
        )
