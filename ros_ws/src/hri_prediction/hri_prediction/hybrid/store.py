"""What is known of people, on the disk: a folder each, which can be listed, moved and deleted.

``person.json`` has the weights of costs that were found, ``<side>_<target>_from_<start>.npz`` each reach
that was learnt. No pictures and no names but the folder's; a folder that is deleted leaves nothing behind.
"""

from __future__ import annotations

import fcntl
import functools
import json
import os
import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.files.sealed import check_seal, sealed
from hri_prediction.files.values import read_json
from hri_prediction.files.whole import write_whole
from hri_prediction.hybrid.prior_path import Geometry, PriorPath
from hri_prediction.hybrid.task import PersonalTask, TaskKey, TaskSettings
from hri_prediction.hybrid.weight_file import data_of_values, data_to_values
from hri_prediction.hybrid.weight_process import WeightData
from hri_prediction.promp.storage import read_npz, write_npz

PERSON_FORMAT, TASK_FORMAT = "hri-person-2", "hri-personal-task-1"
OTHER_SCALE = "hri-person-1"
"""Weights of people of this format have the scale factors of parts of reaches: they are learnt anew."""
PERSON_FILE = "person.json"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")
_ARRAYS = (
    "alpha", "start", "tip", "phases", "values", "q_start", "q_end", "expected", "deviations",
    "durations_s",
)  # fmt: skip


@dataclass(frozen=True)
class KnownPerson:
    """What the store says of a person.

    Attributes:
        name: Of the folder.
        reaches: Of each task, how many were seen.
        weights: How many mean paths were explained.
        changed: Date and time of the last change; empty: not known.
        problem: What is wrong with the folder; empty: nothing.
    """

    name: str
    reaches: dict[str, int]
    weights: int
    changed: str
    problem: str = ""


def check_person(name: str) -> str:
    """A name that can be that of a folder.

    Raises:
        ConfigError: it cannot.
    """
    if not _NAME.fullmatch(name):
        raise ConfigError(
            f"person {name!r:.80}", expected="letters, digits, _ and -, 64 at most, no - or _ first"
        )
    return name


class PeopleStore:
    """People in a folder.

    Args:
        folder: Which; it need not exist before something is kept.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder).expanduser()

    def names(self) -> list[str]:
        """All that have a folder with a person in it.

        Raises:
            ConfigError: the store is a file.
        """
        if self.folder.is_file():
            raise ConfigError(f"{self.folder} is a file", expected="a folder of people")
        files = [*self.folder.glob(f"*/{PERSON_FILE}"), *self.folder.glob("*/*.npz")]
        # What a write that was broken off has left begins with a dot.
        return sorted({path.parent.name for path in files if not path.name.startswith(".")})

    def identity(self, name: str) -> tuple[int, int] | None:
        """Which folder is the person's now (device and inode); none: nothing is kept of anybody so called.

        A name says who it is only as long as nobody moves folders.
        """
        if name not in self.names():
            return None
        try:
            found = self._of(name).stat()
        except OSError:
            return None  # gone meanwhile
        return found.st_dev, found.st_ino

    def people(self) -> list[KnownPerson]:
        """What is known of all; of damaged folders, that they are."""
        return [self._summary(name) for name in self.names()]

    def _summary(self, name: str) -> KnownPerson:
        try:
            tasks, own, changed = self._read(name)
        except (HriError, OSError) as error:
            return KnownPerson(name, {}, 0, "", str(error))
        reaches = {f"{task.key.side} {task.key.name}": task.seen for task in tasks}
        return KnownPerson(name, reaches, len(own) if own is not None else 0, changed)

    def load(self, name: str) -> tuple[list[PersonalTask], WeightData | None]:
        """Tasks and weights of a person; none of either where nothing is kept.

        Raises:
            ConfigError: the name is none.
            DataError: a file is damaged.
        """
        if check_person(name) not in self.names():
            return [], None
        try:
            tasks, own, _ = self._read(name)
        except OSError as error:
            raise DataError(f"cannot read {self._of(name)}: {error.strerror or error}") from error
        return tasks, own

    def _read(self, name: str) -> tuple[list[PersonalTask], WeightData | None, str]:
        folder = self._of(name)
        path = folder / PERSON_FILE
        # Tasks are written first: without the file nothing was explained yet.
        values = read_json(path) if path.exists() else {"format": PERSON_FORMAT}
        if isinstance(values, dict) and values.get("format") == OTHER_SCALE:
            values = {"format": PERSON_FORMAT, "changed": values.get("changed", "")}
        if not isinstance(values, dict) or values.get("format") != PERSON_FORMAT:
            raise DataError(f"{path} is no person", expected=f"JSON of format {PERSON_FORMAT}")
        try:
            own = data_of_values(values["weights"]) if values.get("weights") else None
        except DataError as error:
            raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
        check_seal(values, path)
        files = [file for file in sorted(folder.glob("*.npz")) if not file.name.startswith(".")]
        tasks = [read_task(file) for file in files]
        return tasks, own, str(values.get("changed", ""))

    def save(self, name: str, tasks: Iterable[PersonalTask], own: WeightData) -> None:
        """Keep what is known of a person; each file is as it was, or as it is now, whatever happens.

        Args:
            name: Of the person.
            tasks: That have changed and of which something was seen.
            own: Weights that were found.

        Raises:
            ConfigError: the name is none.
            HriError: the disk does not take it.
        """
        folder = self._of(name)
        content = {
            "format": PERSON_FORMAT,
            "changed": datetime.now(UTC).isoformat(timespec="seconds"),
            "weights": data_to_values(own) if len(own) else None,
        }
        text = json.dumps(sealed(content), indent=1, allow_nan=False) + "\n"
        files: dict[Path, Callable[[Path], object]] = {
            folder / task.key.file: functools.partial(write_task, task=task) for task in tasks
        }
        files[folder / PERSON_FILE] = lambda path: path.write_text(text)
        write_whole(files)

    def claim(self, name: str) -> int | None:
        """Claim a person for this process, as who learns them writes what was read before.

        The claim is an advisory lock on the folder; it ends with the process, or when the descriptor is
        closed.

        Returns:
            A descriptor of the folder; none when another process learns this person.

        Raises:
            ConfigError: the name is none.
            HriError: the folder cannot be made or opened.
        """
        folder = self._of(name)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # Not inherited by children, who would hold it on.
            handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        except OSError as error:
            raise HriError(f"cannot open {folder}: {error.strerror or error}") from error
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(handle)
            return None
        return handle

    def move(self, name: str, new: str) -> Path:
        """Give a person another name; returns the folder.

        Raises:
            ConfigError: there is no such person, or one of the new name.
        """
        source, goal = self.folder_of(name), self._of(new)
        if goal.exists():
            raise ConfigError(f"{goal} is there already", expected="a name that is free")
        return source.rename(goal)

    def delete(self, name: str) -> None:
        """Forget a person: all that is kept of them.

        Raises:
            ConfigError: there is no such person.
        """
        shutil.rmtree(self.folder_of(name))

    def _of(self, name: str) -> Path:
        return self.folder / check_person(name)

    def folder_of(self, name: str) -> Path:
        """The folder of a person.

        Raises:
            ConfigError: there is no such person, saying who is.
        """
        if check_person(name) not in self.names():
            known = ", ".join(self.names()) or "none at all"
            raise ConfigError(
                f"{self.folder} has no person {name}", expected=f"one that is there ({known})"
            )
        return self.folder / name


def write_task(path: Path, task: PersonalTask) -> None:
    """Write one task."""
    arrays = {
        "alpha": task.alpha,
        "start": task.geometry.start,
        "tip": task.geometry.tip,
        "phases": task.path.phases,
        "values": task.path.values,
        "q_start": task.path.q_start,
        "q_end": task.path.q_end,
        "expected": task.expected,
        "deviations": task.deviations,
        "durations_s": task.durations_s,
    }
    header: dict[str, Any] = {
        "format": TASK_FORMAT,
        "side": task.key.side,
        "start": task.key.start,
        "target": task.key.target,
        "share": task.path.share,
        "why_not": task.path.why_not,
        "divergences": list(task.divergences),
        "seen": task.seen,
        "explained": task.explained,
        **({"settings": asdict(task.settings)} if task.settings is not None else {}),
    }
    write_npz(path, arrays, header)


def _settings_of(values: Any) -> TaskSettings | None:
    """What a task was learnt with; older files do not say."""
    if values is None:
        return None
    return TaskSettings(
        tuple(map(str, values["costs"])),
        int(values["count"]),
        float(values["overlap"]),
        float(values["onset_speed"]),
    )


def read_task(path: Path) -> PersonalTask:
    """Read one task.

    Raises:
        DataError: it is missing, damaged, or something else.
    """
    arrays, header = read_npz(path, TASK_FORMAT)
    try:
        found = {name: np.array(arrays[name], dtype=float) for name in _ARRAYS}
        return PersonalTask(
            key=TaskKey(str(header["side"]), str(header["start"]), str(header["target"])),
            alpha=found["alpha"],
            geometry=Geometry(found["start"], found["tip"]),
            path=PriorPath(
                found["phases"],
                found["values"],
                float(header["share"]),
                found["q_start"],
                found["q_end"],
                str(header["why_not"]),
            ),
            expected=found["expected"],
            deviations=found["deviations"],
            durations_s=found["durations_s"],
            divergences=tuple(float(value) for value in header["divergences"]),
            seen=int(header["seen"]),
            explained=int(header["explained"]),
            settings=_settings_of(header.get("settings")),
        )
    except DataError as error:
        raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DataError(f"{path}: it lacks or garbles {error}") from error
