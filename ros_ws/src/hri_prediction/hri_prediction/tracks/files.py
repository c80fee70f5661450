r"""Arm tracks in files: two schemas of our own, and automatic recognition of those of others.

**NPZ, any number of trials** (``numpy.savez``; loads without pickle)

============= ================ ==========================================================
array         shape, type      meaning
============= ================ ==========================================================
``schema``    (), str          ``hri_arm_tracks/1``
``time_s``    (rows,), float   capture times [s], strictly increasing within a trial
``keypoints`` (rows, 4, 3)     shoulder, elbow, wrist, hand tip [m], z up; NaN = not seen
``start``     (n,), int        first row of each trial
``length``    (n,), int        rows of each trial, at least 2
``side``      (n,), str        ``left`` or ``right``
``subject``   (n,), str        name of the person (may be absent)
``task``      (n,), str        name of the movement (may be absent)
``trial``     (n,), int        number of the trial (may be absent)
``source``    (n,), str        where it came from (may be absent)
============= ================ ==========================================================

**CSV, one trial**: comment lines ``# key: value`` (side, subject, task, trial, source), then the
header and the rows. Empty or ``nan`` = not seen. All 13 columns must be there, in any order::

    # side: right
    # subject: ann
    time_s,shoulder_x,shoulder_y,shoulder_z,elbow_x,...,hand_tip_y,hand_tip_z
    0.000,0.750,0.000,0.400,0.741,...

Axes are free but for z, which is up: a :class:`~hri_prediction.tracks.placement.Placement` puts a
track into the robot's world. Foreign files: :mod:`hri_prediction.tracks.adapters` for those that need
no choice, :mod:`hri_prediction.tracks.importers` for all others.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.errors import DataError, HriError, cut, shown
from hri_prediction.files.arrays import parse_arrays
from hri_prediction.files.content import read_content
from hri_prediction.files.whole import write_whole
from hri_prediction.tracks.adapters import (
    is_adl_arrays,
    is_run_arrays,
    tracks_from_adl,
    tracks_from_qtm,
    tracks_from_runs,
)
from hri_prediction.tracks.importers.qtm import is_qtm_text
from hri_prediction.tracks.plausible import check_arm
from hri_prediction.tracks.rate import check_rate
from hri_prediction.tracks.tables import csv_rows, parse_number, row_spans
from hri_prediction.tracks.track import ArmTrack

SCHEMA = "hri_arm_tracks/1"
CSV_COLUMNS = ("time_s", *(f"{point}_{axis}" for point in KEYPOINTS for axis in "xyz"))
_CSV_KEYS = ("side", "subject", "task", "trial", "source")
_TRIAL = re.compile("-?[0-9]{1,9}")
_KNOWN = (
    "an .npz of arm tracks, a .csv with the header time_s,shoulder_x,..., the ADL Vicon reach.npz, "
    "the pick-and-place runs.npz, or a QTM .tsv export"
)
_IMPORT = "scripts/import_mocap.py converts C3D, TRC, BVH, Vicon CSV and other QTM exports"


def load_tracks(path: str | Path) -> list[ArmTrack]:
    """Read the arm tracks of a file, in their order in the file.

    The format is recognised by the content, never by the name alone.

    Args:
        path: A file of one of the formats of this module or of the adapters.

    Returns:
        At least one track, in the axes of its source (see :func:`.seating.suggest_placement`).

    Raises:
        DataError: when the file cannot be read, is of no known format, is malformed, or holds what
            is no arm by its size or sampled too seldom; the text names the file and the first thing
            that is wrong.
    """
    path = Path(path)
    content = read_content(path)
    try:
        is_npz = content[:2] == b"PK"
        tracks = _load_npz(content, path.name) if is_npz else _load_text(content, path)
        for index, track in enumerate(tracks):
            where = f"trial {index}" if len(tracks) > 1 else ""
            check_arm(track, where)
            check_rate(track, where)
        return tracks
    except DataError as error:
        raise DataError(
            f"{path}: {error.problem}", expected=error.expected, hint=error.hint
        ) from error


def save_tracks(path: str | Path, tracks: Sequence[ArmTrack]) -> None:
    """Write tracks as NPZ, or one track as CSV when the name ends in ``.csv``.

    NPZ keeps every bit of the numbers; CSV keeps 1 us and 1 um. Where it cannot be written to the end, a
    file that was there stays as it was.

    Raises:
        DataError: when there are no tracks, more than one for a CSV file, another file name
            ending, or the file cannot be written.
    """
    path = Path(path)
    if not tracks:
        raise DataError(f"no tracks to write to {path}", expected="at least one")
    if path.suffix not in (".npz", ".csv"):
        raise DataError(f"cannot write tracks to {path}", expected="a name in .npz or .csv")
    if path.suffix == ".csv" and len(tracks) != 1:
        raise DataError(
            f"{len(tracks)} tracks for {path}",
            expected="one track in a CSV file",
            hint="write an .npz file instead",
        )
    if not path.parent.is_dir():
        raise DataError(f"cannot write {path}: there is no folder {path.parent}")

    def write(part: Path) -> None:
        if path.suffix == ".csv":
            part.write_text(_csv_text(tracks[0]), encoding="utf-8")
        else:
            np.savez(part, **_npz_arrays(tracks))

    try:
        write_whole({path.resolve(): write})
    except HriError as error:
        raise DataError(str(error)) from error


def _npz_arrays(tracks: Sequence[ArmTrack]) -> dict[str, Any]:
    length = np.array([len(track) for track in tracks])
    return {
        "schema": np.array(SCHEMA),
        "time_s": np.concatenate([track.time_s for track in tracks]),
        "keypoints": np.concatenate([track.keypoints for track in tracks]),
        "start": np.concatenate(([0], np.cumsum(length)[:-1])),
        "length": length,
        "side": np.array([track.side for track in tracks]),
        "subject": np.array([track.subject for track in tracks]),
        "task": np.array([track.task for track in tracks]),
        "trial": np.array([track.trial for track in tracks]),
        "source": np.array([track.source for track in tracks]),
    }


def _csv_text(track: ArmTrack) -> str:
    out = io.StringIO()
    for key in _CSV_KEYS:
        value = " ".join(str(getattr(track, key)).split())
        out.write(f"# {key}: {value}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for time, points in zip(track.time_s, track.keypoints.reshape(len(track), 12), strict=True):
        row = ["" if np.isnan(value) else f"{value:.6f}" for value in points]
        writer.writerow([f"{time:.6f}", *row])
    return out.getvalue()


def _load_npz(content: bytes, name: str) -> list[ArmTrack]:
    try:
        arrays = parse_arrays(content)
    except DataError as error:
        raise DataError(
            f"cannot be read as .npz: {error.problem}", expected=error.expected
        ) from error
    if "schema" in arrays or "keypoints" in arrays:
        return _tracks_from_arrays(arrays)
    if is_adl_arrays(arrays):
        return tracks_from_adl(arrays, name)
    if is_run_arrays(arrays):
        return tracks_from_runs(arrays, name)
    raise DataError(
        f"an .npz with the arrays {cut(', '.join(arrays)) or 'none'} is not known", expected=_KNOWN
    )


def _tracks_from_arrays(arrays: Mapping[str, np.ndarray]) -> list[ArmTrack]:
    schema = str(arrays.get("schema", "none"))
    if schema != SCHEMA:
        raise DataError(f"schema = {shown(schema)}", expected=SCHEMA)
    missing = [
        key for key in ("time_s", "keypoints", "start", "length", "side") if key not in arrays
    ]
    if missing:
        raise DataError(f"array {missing[0]} is missing", expected="the arrays of " + SCHEMA)
    time, points = arrays["time_s"], arrays["keypoints"]
    if time.ndim != 1 or time.dtype.kind not in "fiu":
        raise DataError(f"time_s is {time.dtype} {time.shape}", expected="numbers (rows,)")
    if points.shape != (len(time), 4, 3) or points.dtype.kind != "f":
        raise DataError(
            f"keypoints are {points.dtype} {points.shape}", expected=f"floats ({len(time)}, 4, 3)"
        )
    spans = row_spans(arrays, len(time))
    texts = {key: _column(arrays, key, len(spans), "U") for key in ("side", "subject", "task")}
    texts["source"] = _column(arrays, "source", len(spans), "U")
    numbers = _column(arrays, "trial", len(spans), "iu")
    tracks = []
    for index, (first, last) in enumerate(spans):
        try:
            track = ArmTrack(
                time_s=time[first:last],
                keypoints=points[first:last],
                trial=int(numbers[index]),
                **{key: str(column[index]) for key, column in texts.items()},
            )
        except DataError as error:
            raise DataError(f"trial {index}: {error.problem}", expected=error.expected) from error
        tracks.append(track)
    return tracks


def _column(arrays: Mapping[str, np.ndarray], key: str, count: int, kinds: str) -> np.ndarray:
    """An array of one value a trial; absent ones give empty texts or zeros."""
    if key not in arrays:
        return np.zeros(count, dtype="U1" if kinds == "U" else int)
    column = arrays[key]
    if column.shape != (count,) or column.dtype.kind not in kinds:
        what = "texts" if kinds == "U" else "integers"
        raise DataError(f"{key} is {column.dtype} {column.shape}", expected=f"{what} ({count},)")
    return column


def _load_text(content: bytes, path: Path) -> list[ArmTrack]:
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(
            "neither an .npz archive nor text", expected=_KNOWN, hint=_IMPORT
        ) from error
    if is_qtm_text(text):
        return tracks_from_qtm(text, path.name)
    return [_track_from_csv(text, path.name)]


def _track_from_csv(text: str, name: str) -> ArmTrack:
    values: dict[str, str] = {"source": name}
    lines = text.splitlines()
    body = 0
    while body < len(lines) and (not lines[body].strip() or lines[body].lstrip().startswith("#")):
        key, separator, value = lines[body].strip().lstrip("#").partition(":")
        if separator and key.strip() in _CSV_KEYS:
            values[key.strip()] = value.strip()
        body += 1
    if body == len(lines):
        raise DataError("the file holds no table", expected=_KNOWN)
    header = [cell.strip() for cell in next(csv_rows([lines[body]], body + 1))]
    if "time_s" not in header:
        raise DataError(f"line {body + 1} is {lines[body][:60]!r}", expected=_KNOWN, hint=_IMPORT)
    missing = [column for column in CSV_COLUMNS if column not in header]
    if missing:
        raise DataError(f"column {missing[0]} is missing", expected=", ".join(CSV_COLUMNS))
    order = [header.index(column) for column in CSV_COLUMNS]
    rows = []
    for number, cells in enumerate(csv_rows(lines[body + 1 :], body + 2), start=body + 2):
        if not cells:
            continue
        if len(cells) != len(header):
            raise DataError(f"line {number} has {len(cells)} cells", expected=str(len(header)))
        rows.append([parse_number(cells[column], f"line {number}") for column in order])
    if len(rows) < 2:
        raise DataError(f"the table has {len(rows)} rows", expected="at least two")
    table = np.array(rows)
    trial = values.get("trial") or "0"
    if not _TRIAL.fullmatch(trial):
        raise DataError(f"trial: {shown(trial)}", expected="a whole number")
    return ArmTrack(
        time_s=table[:, 0],
        keypoints=table[:, 1:].reshape(-1, 4, 3),
        side=values.get("side", "right"),
        subject=values.get("subject", ""),
        task=values.get("task", ""),
        trial=int(trial),
        source=values["source"],
    )
