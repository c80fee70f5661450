"""A library of policies that were learnt with people: what is there, and how the ways differ by person.

A folder with one file a person in a folder an experiment: ``<experiment>/<person>.npz``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hri_planner.dmp.model_file import read_dmp, save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.comparison import Comparison, compared
from hri_planner.pibb.names import check_name, is_name
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.files.whole import write_whole


@dataclass(frozen=True)
class Entry:
    """What the library says of a policy.

    Attributes:
        experiment: That it was learnt in.
        person: With whom.
        file: Where it is.
        goals: Names of its goals.
        updates: Of the policy until then; none where the file does not say, as with all below.
        trials: Until then, the habituation among them.
        cost_first: Mean cost of the first update's trials.
        cost_last: Mean cost of the last update's trials.
        saved: Date and time; empty where the file does not say.
        commit: Of the code at work; empty where the file does not say.
        problem: Why it cannot be used; empty: it can.
    """

    experiment: str
    person: str
    file: Path
    goals: tuple[str, ...] = ()
    updates: int | None = None
    trials: int | None = None
    cost_first: float | None = None
    cost_last: float | None = None
    saved: str = ""
    commit: str = ""
    problem: str = ""


class PolicyLibrary:
    """Policies in a folder.

    Args:
        folder: Which; it need not exist before something is added.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)

    def entries(self) -> tuple[Entry, ...]:
        """All policies by experiment and person; damaged ones say so.

        Raises:
            ConfigError: when the folder is a file.
        """
        if self.folder.is_file():
            raise ConfigError(f"{self.folder} is a file", expected="the folder of a library")
        files = sorted(self.folder.glob("*/*.npz"))
        return tuple(_entry(file) for file in files if not file.name.startswith("."))

    def add(
        self,
        policy: DmpPolicy,
        person: str,
        experiment: str,
        learnt: Mapping[str, Any],
        *,
        replace: bool = False,
    ) -> Path:
        """Add a policy.

        Args:
            policy: The policy.
            person: With whom it was learnt.
            experiment: In which.
            learnt: How it came about, as :func:`hri_planner.pibb.storage.learnt_in` says it.
            replace: Whether it takes the place of one that is there.

        Returns:
            Its file.

        Raises:
            ConfigError: when a name cannot be that of a file, or one is there that is not to be replaced.
            HriError: when the file cannot be written; one that was there is as it was.
        """
        file = self._file(experiment, person)
        if file.exists() and not replace:
            raise ConfigError(
                f"{file} is there already", hint="choose another name or add --replace"
            )
        now = datetime.now(UTC).isoformat(timespec="seconds")
        said = {"saved": now, **learnt, "experiment": experiment, "person": person}
        write_whole({file: lambda path: save_dmp(path, policy, said)})
        return file

    def file_of(self, experiment: str, person: str) -> Path:
        """The file of a policy.

        Raises:
            ConfigError: when it is not there, saying what is.
        """
        file = self._file(experiment, person)
        if not file.is_file():
            known: dict[str, list[str]] = {}
            for entry in self.entries():
                known.setdefault(entry.experiment, []).append(entry.person)
            there = [f"{name}: {', '.join(persons)}" for name, persons in known.items()]
            if experiment in known:
                there = [", ".join(known[experiment])]
            raise ConfigError(
                f"{self.folder} has no policy of {person} for {experiment}",
                expected=f"one that is there ({'; '.join(there)})" if there else "",
                hint="" if there else "it has none at all: add one",
            )
        return file

    def read(self, experiment: str, person: str) -> tuple[DmpPolicy, dict[str, Any]]:
        """A policy, and how it came about.

        Raises:
            ConfigError: when it is not there, saying what is.
            DataError: when its file is damaged.
        """
        return read_dmp(self.file_of(experiment, person))

    def load(self, experiment: str, person: str) -> DmpPolicy:
        """A policy; errors as :meth:`read`."""
        return self.read(experiment, person)[0]

    def compare(self, experiment: str, persons: Sequence[str] = ()) -> Comparison:
        """Policies of an experiment beside each other.

        Args:
            experiment: Which.
            persons: Whose; none: of all.

        Raises:
            ConfigError: when one is named twice, or is not there.
            DataError: when a file is damaged.
        """
        named = list(persons)
        if not named:
            named = [one.person for one in self.entries() if one.experiment == experiment]
        if not named:
            known = sorted({entry.experiment for entry in self.entries()})
            raise ConfigError(
                f"{self.folder} has no policy for {experiment}",
                expected=f"one of {', '.join(known)}" if known else "",
                hint="" if known else "it has none at all: add one",
            )
        if len(set(named)) < len(named):
            raise ConfigError(f"persons {', '.join(named)}", expected="each once")
        return compared(experiment, {person: self.load(experiment, person) for person in named})

    def _file(self, experiment: str, person: str) -> Path:
        check_name("experiment", experiment)
        check_name("person", person)
        return self.folder / experiment / f"{person}.npz"


def _entry(file: Path) -> Entry:
    found = Entry(file.parent.name, file.stem, file)
    if not (is_name(found.experiment) and is_name(found.person)):
        return replace(found, problem="a name that the library does not take")
    try:
        policy, learnt = read_dmp(file)
    except DataError as error:
        return replace(found, problem=error.problem)
    return replace(
        found,
        goals=policy.names,
        updates=_number(learnt.get("updates"), int),
        trials=_number(learnt.get("trials"), int),
        cost_first=_number(learnt.get("cost_first"), float),
        cost_last=_number(learnt.get("cost_last"), float),
        saved=_words(learnt.get("saved")),
        commit=_words(learnt.get("commit")),
    )


def _number(value: object, kind: type[Any]) -> Any:
    """A finite number of a header; none where there is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return kind(value) if math.isfinite(value) else None
    except OverflowError:
        return None


def _words(value: object) -> str:
    return value if isinstance(value, str) else ""
