"""Explained reaches of many people, a row each: what all analyses start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.motor_control.batch import Outcome
from hri_prediction.motor_control.costs import DYNAMIC, shares
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.promp.storage import read_npz, write_npz

Array = NDArray[np.float64]
Names = NDArray[np.str_]

FORMAT = "hri-explained-reaches-1"
PHASES = 101
"""Samples of joint angles that are kept of each reach."""


@dataclass(frozen=True, eq=False)
class ReachTable:
    """N explained reaches, with n costs.

    Attributes:
        names: The costs (n,).
        person: Who reached (N,).
        start: Where from (N,).
        target: Where to (N,).
        error: Why a reach could not be explained (N,); empty: it was. Of others, all that was to be
            found out is NaN.
        q_start, q_end: Postures at both ends (N, 3) [rad].
        v_start, v_end: Joint velocities there (N, 3) [rad/s].
        duration_s: (N,).
        angles: Joint angles at evenly spaced phases (N, PHASES, 3) [rad].
        end_m: Where the hand ends, from the shoulder (N, 3).
        length_m: From where it begins to where it ends (N,).
        mean_speed, peak_speed: Of the hand (N,) [m/s].
        misfit_cm: How far elbow and wrist of the model are from where they were seen (N,).
        alpha, sd, factors: Weights, their standard deviations, scale factors (N, n).
        hand_cm, joint_deg: Distances of the optimum by dynamic time warping and sample (N,).
        single_cm, single_joint_deg: The same of each cost alone (N, n).
        truth: True weights (N, n); NaN where nobody knows them.
    """

    names: tuple[str, ...]
    person: Names
    start: Names
    target: Names
    error: Names
    q_start: Array
    q_end: Array
    v_start: Array
    v_end: Array
    duration_s: Array
    angles: Array
    end_m: Array
    length_m: Array
    mean_speed: Array
    peak_speed: Array
    misfit_cm: Array
    alpha: Array
    sd: Array
    factors: Array
    hand_cm: Array
    joint_deg: Array
    single_cm: Array
    single_joint_deg: Array
    truth: Array

    def __len__(self) -> int:
        return len(self.person)

    @property
    def task(self) -> Names:
        """Where from and where to (N,)."""
        return np.char.add(np.char.add(self.start, " "), self.target)

    @property
    def dynamic(self) -> Array:
        """Share of the dynamic costs in alpha (N,)."""
        return shares(self.alpha, self.names, DYNAMIC)

    def where(self, chosen: NDArray[Any]) -> ReachTable:
        """Some of the rows, by index or mask."""
        return ReachTable(self.names, **{k: getattr(self, k)[chosen] for k in _COLUMNS})

    @property
    def explained(self) -> ReachTable:
        """The rows that were explained."""
        return self.where(self.error == "")

    def of(self, people: Sequence[str]) -> ReachTable:
        """The rows of some people."""
        return self.where(np.isin(self.person, people))

    def save(self, path: Path) -> None:
        """Write all of it (NPZ)."""
        columns = {key: getattr(self, key) for key in _COLUMNS}
        write_npz(path, columns, {"format": FORMAT, "names": list(self.names)})


_COLUMNS = tuple(field.name for field in fields(ReachTable) if field.name != "names")


def load(path: Path) -> ReachTable:
    """Read what :meth:`ReachTable.save` has written.

    Raises:
        DataError: it is none.
    """
    arrays, header = read_npz(path, FORMAT)
    names = tuple(map(str, header.get("names", ())))
    if not names or set(_COLUMNS) - set(arrays):
        raise DataError(f"{path} holds no explained reaches", expected=f"a file of {FORMAT}")
    return ReachTable(names, **{key: arrays[key] for key in _COLUMNS})


def together(tables: Sequence[ReachTable]) -> ReachTable:
    """All rows of some tables.

    Raises:
        DataError: there are none, or they are of different costs.
    """
    if len({table.names for table in tables}) != 1:
        raise DataError(
            "tables of different costs, or none", expected="one table or more of the same costs"
        )
    return ReachTable(
        tables[0].names,
        **{key: np.concatenate([getattr(table, key) for table in tables]) for key in _COLUMNS},
    )


def table_of(
    names: Sequence[str],
    reaches: Sequence[ObservedReach],
    outcomes: Sequence[Outcome],
    *,
    person: Sequence[str],
    start: Sequence[str],
    target: Sequence[str],
    truth: Array | None = None,
) -> ReachTable:
    """Make a table.

    Args:
        names: The costs.
        reaches: What was seen.
        outcomes: What explains each.
        person: Who each was.
        start: Where from.
        target: Where to.
        truth: True weights (N, n), where they are known.

    Raises:
        DataError: without reaches.
    """
    if not reaches:
        raise DataError("no reaches", expected="one or more")
    count, size = len(reaches), len(names)
    phases = np.linspace(0.0, 1.0, PHASES)

    def found(key: str, scale: float = 1.0) -> Array:
        wide = key in ("alpha", "sd", "factors", "single_cm", "single_joint_deg")
        nothing = np.full(size, np.nan) if wide else np.nan
        rows = [nothing if o.error else np.array(getattr(o, key), float) for o in outcomes]
        return scale * np.array(rows, dtype=float)

    problems = [each.problem for each in reaches]
    hands = [each.hand for each in reaches]
    speeds = [
        np.linalg.norm(np.gradient(each.hand, each.phases * each.problem.duration, axis=0), axis=1)
        for each in reaches
    ]
    durations = np.array([problem.duration for problem in problems])
    lengths = [float(np.linalg.norm(np.diff(h, axis=0), axis=1).sum()) for h in hands]
    return ReachTable(
        names=tuple(names),
        person=np.array(person),
        start=np.array(start),
        target=np.array(target),
        error=np.array([outcome.error for outcome in outcomes]),
        q_start=np.array([problem.q_start for problem in problems]),
        q_end=np.array([problem.q_end for problem in problems]),
        v_start=np.array([problem.v_start for problem in problems]),
        v_end=np.array([problem.v_end for problem in problems]),
        duration_s=durations,
        angles=np.array(
            [
                np.column_stack([np.interp(phases, r.phases, column) for column in r.angles.T])
                for r in reaches
            ]
        ),
        end_m=np.array([h[-1] for h in hands]),
        length_m=np.array([float(np.linalg.norm(h[-1] - h[0])) for h in hands]),
        mean_speed=np.array(lengths) / durations,
        peak_speed=np.array([float(speed.max()) for speed in speeds]),
        misfit_cm=np.array([100.0 * each.misfit_m for each in reaches]),
        alpha=found("alpha"),
        sd=found("sd"),
        factors=found("factors"),
        hand_cm=found("distance_cm"),
        joint_deg=found("joint_distance_deg"),
        single_cm=found("single_cm"),
        single_joint_deg=found("single_joint_deg"),
        truth=np.full((count, size), np.nan) if truth is None else np.array(truth, dtype=float),
    )
