"""Movement segments with what is known of them: what classifiers are trained and judged on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.cases import find_case, group_of
from hri_prediction.ontology.features import COUNT
from hri_prediction.promp.storage import read_npz, write_npz

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
TextArray = NDArray[np.str_]

FORMAT = "hri-interaction-segments-1"
_COLUMNS = {"case": "iu", "subject": "U", "position": "U", "session": "iu"}


@dataclass(frozen=True, eq=False)
class SegmentTable:
    """Segments, a row each.

    Attributes:
        features: Their mean features (n, 25) [m].
        case: Numbers of their cases (n,), 1 to 20.
        subject: Who the one of the two was that changes from dyad to dyad (n,).
        position: How the two were placed (n,).
        session: Number of the recording (n,).
    """

    features: FloatArray
    case: IntArray
    subject: TextArray
    position: TextArray
    session: IntArray

    def __post_init__(self) -> None:
        """Check that all fits together."""
        if self.features.ndim != 2 or self.features.shape[1] != COUNT:
            raise DataError(f"features have shape {self.features.shape}", expected=f"(n, {COUNT})")
        if not np.isfinite(self.features).all():
            raise DataError("features that are not finite", expected="finite distances")
        for name in _COLUMNS:
            if (column := getattr(self, name)).shape != (len(self),):
                raise DataError(f"{name} has shape {column.shape}", expected=f"({len(self)},)")
        for number in np.unique(self.case):
            find_case(int(number))

    def __len__(self) -> int:
        """Number of segments."""
        return len(self.features)

    @property
    def group(self) -> IntArray:
        """Numbers of their groups in the reduced ontology (n,), 1 to 7."""
        return np.array([group_of(int(case)) for case in self.case], dtype=np.int64)

    @property
    def subjects(self) -> list[str]:
        """Everybody, by name."""
        return sorted(set(self.subject.tolist()))

    def where(self, rows: NDArray[np.bool_]) -> SegmentTable:
        """Some of the rows."""
        columns = {name: getattr(self, name)[rows] for name in _COLUMNS}
        return SegmentTable(self.features[rows], **columns)

    def save(self, path: str | Path) -> None:
        """Write it as .npz."""
        columns = {name: getattr(self, name) for name in _COLUMNS}
        write_npz(path, {"features": self.features, **columns}, {"format": FORMAT})

    @classmethod
    def load(cls, path: str | Path) -> SegmentTable:
        """Read what :meth:`save` wrote.

        Raises:
            DataError: when it is missing, damaged or something else.
        """
        arrays, _ = read_npz(path, FORMAT)
        for name, kinds in {"features": "f", **_COLUMNS}.items():
            if name not in arrays or arrays[name].dtype.kind not in kinds:
                raise DataError(
                    f"{path} has no {name} of the right kind", expected=f"a whole {FORMAT}"
                )
        try:
            return cls(**{name: arrays[name] for name in ("features", *_COLUMNS)})
        except (ConfigError, DataError) as error:
            raise DataError(f"{path}: {error.problem}", expected=error.expected) from error


def table_of(
    features: Sequence[FloatArray],
    case: Iterable[int],
    subject: Iterable[str],
    position: Iterable[str],
    session: Iterable[int],
) -> SegmentTable:
    """A table of columns that were gathered."""
    return SegmentTable(
        np.array(features, dtype=float).reshape(-1, COUNT),
        np.array(list(case), dtype=np.int64),
        np.array(list(subject), dtype=np.str_),
        np.array(list(position), dtype=np.str_),
        np.array(list(session), dtype=np.int64),
    )


def joined(tables: Sequence[SegmentTable]) -> SegmentTable:
    """All rows of some tables."""
    columns = {name: np.concatenate([getattr(t, name) for t in tables]) for name in _COLUMNS}
    return SegmentTable(np.concatenate([t.features for t in tables]), **columns)
