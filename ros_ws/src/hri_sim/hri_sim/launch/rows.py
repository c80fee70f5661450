"""Rows of a table, each a run of a minute: kept as they come, so that no failure costs the others."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from hri_prediction.errors import ConfigError, HriError
from hri_sim.launch.folder import NewFolder, remove
from hri_sim.launch.telling import explain

ROWS = "rows.json"
ERROR = "error"
"""Outcome of a run of which there are no figures."""

Row = dict[str, Any]


class KeptRows:
    """Makes rows by runs, or takes them as an earlier call of the same command has made them.

    Args:
        runs: Folder of the runs: new or empty, or one in which rows are kept already.
        origin: Where results come from; rows of another commit or machine are not taken.
        console: Is told why a run failed.

    Raises:
        ConfigError: when the folder cannot be used.
    """

    def __init__(self, runs: Path, origin: dict[str, Any], console: Console) -> None:
        self._runs = runs
        self._console = console
        self._origin = {name: origin[name] for name in ("commit", "machine")}
        self._kept: dict[str, dict[str, Any]] = {}
        if (runs / ROWS).is_file():
            self._kept = self._read()
        else:
            NewFolder(runs, "--runs")
            self._write()

    def row(self, name: str, options: dict[str, Any], make: Callable[[Path], Row]) -> Row:
        """One row; that of a run that failed is made again by the next call of the command.

        Args:
            name: Name of the run, and of its folder.
            options: What it depends on; a row that was made of others is not taken.
            make: Makes the row by a run in a folder that does not exist yet.

        Returns:
            The row; of a run that failed its outcome is :data:`ERROR`, with the reason.
        """
        kept = self._kept.get(name)
        if kept is not None and kept["options"] == options and kept["row"]["outcome"] != ERROR:
            self._console.print(f"{name}: taken from {self._runs}", highlight=False, markup=False)
            return dict(kept["row"])
        folder = self._runs / name
        remove(folder)  # what a run that failed or was broken off has left
        try:
            row = make(folder)
        except HriError as error:
            explain(error, self._console)
            row = {"outcome": ERROR, "reason": str(error), "reaches": []}
        self._kept[name] = {"options": options, "row": row}
        self._write()
        return row

    def _read(self) -> dict[str, dict[str, Any]]:
        path = self._runs / ROWS
        try:
            content = json.loads(path.read_text())
            origin, rows = content["origin"], content["rows"]
        except (ValueError, KeyError) as error:
            raise ConfigError(
                f"{path} holds no rows: {error}", hint="choose another folder with --runs"
            ) from error
        if origin != self._origin:
            raise ConfigError(
                f"--runs {self._runs} holds runs of commit {origin['commit']}"
                f" on {origin['machine']['cpu']}",
                expected=f"of {self._origin['commit']} on {self._origin['machine']['cpu']}",
                hint="choose another folder with --runs: one table has one origin",
            )
        return dict(rows)

    def _write(self) -> None:
        content = {"origin": self._origin, "rows": self._kept}
        temporary = self._runs / f"{ROWS}.tmp"
        temporary.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
        temporary.replace(self._runs / ROWS)


def outcome_cell(row: Row) -> str:
    """The outcome, and why it is not another one, as a cell of a table."""
    reasons = [reach["reason"] for reach in row["reaches"] if reach["outcome"] != "reached"]
    cause = row.get("reason") or (reasons[0] if reasons else "")
    text = row["outcome"] if row["outcome"] == "reached" else f"{row['outcome']}: {cause}"
    return " ".join(text.replace("|", "/").split())


def failures(rows: dict[Any, Row]) -> int:
    """How many runs there are no figures of."""
    return sum(row["outcome"] == ERROR for row in rows.values())
