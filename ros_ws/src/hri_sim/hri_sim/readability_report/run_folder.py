"""What came of each person's experiment, as files: nobody need take part twice.

``EXPERIMENT/MARK/seed_N.json`` and ``.npz``. The mark stands for all that decides about the result but the
seed: results of other code or settings lie in other folders, and are never taken for these.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import Terms
from hri_planner.pibb.experiment_file import to_mapping
from hri_planner.pibb.session import result_of, row_of
from hri_prediction.compiled import processor
from hri_prediction.errors import HriError
from hri_prediction.promp.storage import read_npz, write_npz
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.benchmark.workers import versions
from hri_sim.readability.learning import Learnt, Reading
from hri_sim.readability.traits import Traits
from hri_sim.readability_report.cases import READINGS, SMOKE_READINGS, TEACHER, TEACHER_SEED, Case
from hri_sim.readability_report.work import Done

FORMAT = "hri-dmp-means-1"
WORK = "hri_sim.readability_report.work"
"""The module that results come from: what it depends on decides about them."""
READ = ("before", "after", "others_before", "others_after")


class RunFolder:
    """Results that are done.

    Args:
        folder: Where they are; it need not exist.
        smoke: Whether they are those of a smoke run.
    """

    def __init__(self, folder: Path, smoke: bool) -> None:
        self.folder = folder
        self.smoke = smoke
        self.readings = SMOKE_READINGS if smoke else READINGS
        self._marks: dict[str, str] = {}

    def file(self, case: Case, seed: int) -> Path:
        """Of a result; that of the policies is beside it."""
        return self.folder / case.name / self.mark(case) / f"seed_{seed}.json"

    def mark(self, case: Case) -> str:
        """Stands for all that decides about a result but its seed."""
        if case.name not in self._marks:
            self._marks[case.name] = self._mark(case)
        return self._marks[case.name]

    def _mark(self, case: Case) -> str:
        taught = [to_mapping(TEACHER.experiment(self.smoke)), TEACHER_SEED] if case.taught else []
        parts = (
            json.dumps([to_mapping(case.experiment(self.smoke)), taught]),
            self.readings,
            dependency_hash(WORK),
            processor(),
            sorted(versions().items()),
        )
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]

    def add(self, case: Case, done: Done, origin: Mapping[str, Any]) -> None:
        """Keep a result."""
        path, learnt = self.file(case, done.seed), done.learnt
        path.parent.mkdir(parents=True, exist_ok=True)
        names = list(learnt.first.names)
        arrays = {
            "start": learnt.first.start,
            "posture": learnt.first.posture,
            "goals": np.array([learnt.first.goals[name] for name in names]),
            "weights": np.array([[mean.weights[name] for name in names] for mean in learnt.means]),
        }
        header = {"format": FORMAT, "goals": names, "duration": learnt.first.duration}
        content = {
            "experiment": case.name,
            "seed": done.seed,
            "origin": dict(origin),
            "seconds": round(done.seconds, 3),
            "traits": asdict(learnt.traits),
            "contacts": learnt.contacts,
            "from_person": learnt.from_person,
            "from_obstacles": learnt.from_obstacles,
            "broken_off": learnt.broken_off,
            "readings": {name: asdict(getattr(learnt, name)) for name in READ},
            "units": {goal: asdict(unit) for goal, unit in learnt.units.items()},
            "trials": [row_of(result) for result in learnt.results],
        }
        # The text last, for it says that all is done.
        write_npz(path.with_suffix(".npz"), arrays, header)
        write_json(path, content)

    def read(self, case: Case, seed: int) -> tuple[Learnt, dict[str, Any]] | None:
        """A result and where it comes from; none when it is not there, or damaged."""
        path = self.file(case, seed)
        try:
            content = json.loads(path.read_text())
            means = _means(path.with_suffix(".npz"))
            readings = {name: Reading(**content["readings"][name]) for name in READ}
            traits = content["traits"]
            learnt = Learnt(
                seed=int(content["seed"]),
                traits=Traits(**{**traits, "prior": tuple(traits["prior"])}),
                first=means[0],
                last=means[-1],
                means=means,
                units={goal: Terms(**unit) for goal, unit in content["units"].items()},
                results=tuple(map(result_of, content["trials"])),
                contacts=int(content["contacts"]),
                from_person=float(content["from_person"]),
                from_obstacles=float(content["from_obstacles"]),
                broken_off=int(content["broken_off"]),
                **readings,
            )
            return learnt, dict(content["origin"])
        except (OSError, ValueError, KeyError, TypeError, IndexError, HriError):
            return None

    def seeds(self, case: Case) -> list[int]:
        """Of all results of an experiment that are there."""
        there = (self.folder / case.name / self.mark(case)).glob("seed_*.json")
        numbers = (path.stem.removeprefix("seed_") for path in there)
        return sorted(int(number) for number in numbers if number.isdigit())


def _means(path: Path) -> tuple[DmpPolicy, ...]:
    arrays, header = read_npz(path, FORMAT)
    names = [str(name) for name in header["goals"]]
    goals = dict(zip(names, arrays["goals"], strict=True))
    start, posture, duration = arrays["start"], arrays["posture"], float(header["duration"])
    rows = (dict(zip(names, own, strict=True)) for own in arrays["weights"])
    return tuple(DmpPolicy(start, posture, goals, own, duration) for own in rows)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """A half-written file never takes the place of a whole one."""
    new = path.with_suffix(".new")
    new.write_text(json.dumps(content, allow_nan=False, indent=1) + "\n")
    new.replace(path)
