"""The record of a soak: one line of JSON after the other, readable up to wherever it was cut."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hri_prediction.closing import Closing
from hri_prediction.errors import DataError
from hri_prediction.files.content import open_file

LOG = "soak.jsonl"
"""File in the folder of a run."""
BEGIN, SAMPLE, REACH, FAULT, DEATH, TOLD, END = (
    "begin",
    "sample",
    "reach",
    "fault",
    "death",
    "told",
    "end",
)
MOST_LINE = 1 << 20
"""No line is longer than that [bytes]."""


class SoakLog(Closing):
    """Writes lines as they come; a process that is killed loses none that was written.

    Args:
        path: The file; it is made.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", buffering=1)

    def write(self, kind: str, content: Mapping[str, Any]) -> None:
        """Add a line."""
        line = json.dumps({"kind": kind, **content}, allow_nan=False, separators=(",", ":"))
        self._file.write(line + "\n")

    def close(self) -> None:
        """No more lines."""
        self._file.close()


@dataclass
class SoakRecord:
    """What a log holds.

    Attributes:
        begin: What was asked for.
        rows: All other lines by their kind.
        cut: Whether the end is missing: the script was killed.
    """

    begin: dict[str, Any]
    rows: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    @property
    def cut(self) -> bool:
        """Whether the end is missing: the script was killed."""
        return not self.rows.get(END)

    def of(self, kind: str) -> list[dict[str, Any]]:
        """Lines of one kind, in order."""
        return self.rows.get(kind, [])


def read_log(path: Path) -> SoakRecord:
    """Read a log; a last line that is not whole is left out.

    Raises:
        DataError: when there is none, or it is none of a soak.
    """
    record: SoakRecord | None = None
    with open_file(path) as stream:
        for raw in iter(lambda: stream.readline(MOST_LINE), b""):
            if not raw.endswith(b"\n"):
                break
            try:
                row = json.loads(raw)
                kind = row.pop("kind")
            except (ValueError, KeyError, AttributeError, TypeError, RecursionError) as error:
                raise DataError(f"{path} is no record of a soak") from error
            if record is None:
                if kind != BEGIN:
                    break
                record = SoakRecord(row)
            else:
                record.rows.setdefault(kind, []).append(row)
    if record is None:
        raise DataError(f"{path} is no record of a soak", expected=f"a {LOG} of scripts/soak.py")
    return record
